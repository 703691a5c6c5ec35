// SPDX-License-Identifier: Apache-2.0
// The bytes of an image file, and the formats whose headers are long to check. Private to
// image_header.cpp.
#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <string>

#include "volcomp/base/error.h"
#include "volcomp/base/image_header.h"

namespace volcomp {

/// Most channels of an image.
constexpr int kMostImageChannels = 1024;

/// The bytes of an open file.
class ImageBytes {
public:
    /// Throws Error if the stream is no regular file.
    ImageBytes(const std::filesystem::path& file, std::FILE* stream);

    std::int64_t size() const { return m_size; }
    /// `count` bytes from `at` on; fewer at the file's end.
    std::string read(std::int64_t at, std::int64_t count) const;
    /// An unsigned number of `count` bytes. Throws Error at the file's end.
    std::uint32_t number(std::int64_t at, int count, bool big_endian) const;

    Error damaged(const std::string& found) const;
    /// For a kind of a format that this program does not read.
    Error refused(const std::string& expected, const std::string& found) const;

private:
    std::filesystem::path m_file;
    int m_handle;
    std::int64_t m_size = 0;
};

/// Checks that the pieces of pixels lie in the file; says whether it has a display window.
bool checkTiff(const ImageBytes& bytes);
void checkExr(const std::filesystem::path& file, const ImageHeader& header,
              const ImageBytes& bytes);

} // namespace volcomp
