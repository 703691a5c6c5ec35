// SPDX-License-Identifier: Apache-2.0
// A folder for the files of one test.
#pragma once

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <system_error>

#include <gtest/gtest.h>

namespace volcomp {

/// Makes an empty folder below testing::TempDir() and removes it with all its files at the end of
/// its life. Every object has a folder of its own, also among tests that run at the same time and
/// builds that are tested at the same time. Throws std::system_error if the folder cannot be made.
class TemporaryFolder {
public:
    TemporaryFolder()
    {
        std::string name = (std::filesystem::path(testing::TempDir()) / "volcomp_XXXXXX").string();
        if (!mkdtemp(name.data())) throw std::system_error(errno, std::generic_category(), name);
        m_path = name;
    }
    ~TemporaryFolder()
    {
        std::error_code ignored;
        std::filesystem::remove_all(m_path, ignored);
    }
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;

    const std::filesystem::path& path() const { return m_path; }
    /// Returns the path of a file of that name in the folder; the file need not exist.
    std::filesystem::path operator/(const std::string& name) const { return m_path / name; }

    /// Writes the bytes of `text` into a file in the folder and returns the file's path.
    std::filesystem::path write(const std::string& name, const std::string& text) const
    {
        std::ofstream(m_path / name, std::ios::binary) << text;
        return m_path / name;
    }
    /// Returns the bytes of a file in the folder; they are none if there is no such file.
    std::string read(const std::string& name) const
    {
        std::ifstream stream(m_path / name, std::ios::binary);
        return {std::istreambuf_iterator<char>(stream), {}};
    }

private:
    std::filesystem::path m_path;
};

} // namespace volcomp
