// SPDX-License-Identifier: Apache-2.0
// The files that the fuzzers give to the readers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include <unistd.h>

namespace volcomp {

/// A folder of this process below TMPDIR, which tests/fuzz.sh puts into memory. It goes at the end.
class Scratch {
public:
    Scratch()
    {
        std::string name =
            (std::filesystem::temp_directory_path() / "volcomp_fuzzer_XXXXXX").string();
        if (!mkdtemp(name.data())) std::abort();
        m_folder = name;
    }
    ~Scratch()
    {
        std::error_code ignored;
        std::filesystem::remove_all(m_folder, ignored);
    }
    Scratch(const Scratch&) = delete;
    Scratch& operator=(const Scratch&) = delete;

    const std::filesystem::path& folder() const { return m_folder; }

    /// Makes a file of that name with these bytes, instead of one that is there, and returns its
    /// path.
    std::filesystem::path write(const std::string& name, const std::uint8_t* data,
                                std::size_t size) const
    {
        const std::filesystem::path file = m_folder / name;
        std::ofstream(file, std::ios::binary | std::ios::trunc)
            .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
        return file;
    }

private:
    std::filesystem::path m_folder;
};

} // namespace volcomp
