// SPDX-License-Identifier: Apache-2.0
// Any bytes as a scene file: a scene, or an Error. Warnings, the files that it names and what its
// recipe keeps of its tables are looked at too.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include <unistd.h>

#include "volcomp/base/error.h"
#include "volcomp/scene/scene.h"
#include "volcomp/scene/toml_reader.h"

namespace {

namespace fs = std::filesystem;
using namespace volcomp;

/// A file of this process in memory; it is removed at the end.
class ScratchFile {
public:
    ScratchFile()
        : m_path("/dev/shm/volcomp_scene_fuzzer_" + std::to_string(getpid()) + ".toml") { }
    ~ScratchFile()
    {
        std::error_code ignored;
        fs::remove(m_path, ignored);
    }
    const fs::path& write(const std::string& text) const
    {
        std::ofstream(m_path, std::ios::binary | std::ios::trunc) << text;
        return m_path;
    }

private:
    fs::path m_path;
};

void require(bool holds, const char* what)
{
    if (holds) return;
    std::fprintf(stderr, "broken: %s\n", what);
    std::abort();
}

void requireMessage(const std::string& message)
{
    require(message.find("/dev/shm/volcomp_scene_fuzzer_") != std::string::npos,
            "a message names the file");
    require(message.size() < 20000, "a message is short");
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    static const ScratchFile scratch;
    const std::string text(reinterpret_cast<const char*>(data), size);
    try {
        const Scene scene = readScene(scratch.write(text));
        for (const std::string& warning : scene.warnings) requireMessage(warning);
        require(!usedFiles(scene).empty(), "a scene has a file");
        std::istringstream lines(TableReader::open(scratch.write(text)).toml());
        for (std::string line; std::getline(lines, line);)
            require(line.find(" = ") != line.npos, "toml() has one line for each value");
    } catch (const Error& e) {
        requireMessage(e.what());
    }
    return 0;
}
