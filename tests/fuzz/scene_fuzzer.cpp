// SPDX-License-Identifier: Apache-2.0
// Any bytes as a scene file: a scene, or an Error. Warnings, the files that it names and what its
// recipe keeps of its tables are looked at too.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <string>

#include "tests/fuzz/scratch.h"
#include "volcomp/base/error.h"
#include "volcomp/scene/scene.h"

namespace {

using namespace volcomp;

void require(bool holds, const char* what)
{
    if (holds) return;
    std::fprintf(stderr, "broken: %s\n", what);
    std::abort();
}

void requireMessage(const std::string& message)
{
    require(message.find("volcomp_fuzzer_") != std::string::npos, "a message names the file");
    require(message.size() < 20000, "a message is short");
}

/// What recipes take from a table's record.
void requireLines(const std::string& record)
{
    std::istringstream lines(record);
    for (std::string line; std::getline(lines, line);)
        require(line.find(" = ") != line.npos, "a record has one line for each value");
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    static const Scratch scratch;
    const std::filesystem::path file = scratch.write("scene.toml", data, size);
    try {
        const Scene scene = readScene(file);
        for (const std::string& warning : scene.warnings) requireMessage(warning);
        require(!usedFiles(scene).empty(), "a scene has a file");
        for (const GrowthRule& rule : scene.boxes) requireLines(rule.source);
        for (const Layer& layer : scene.layers) requireLines(layer.source);
    } catch (const Error& e) {
        requireMessage(e.what());
    }
    return 0;
}
