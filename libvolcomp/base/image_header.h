// SPDX-License-Identifier: Apache-2.0
// What an image file promises, found before a library takes memory for it.
#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <string>

namespace volcomp {

/// Largest width and height of an image.
constexpr std::int64_t kMostPixelsAcross = 1 << 20;
/// Most values (pixels times channels) of an image.
constexpr double kMostImageValues = 4e9;

/// What the bytes of a file say about the image in it.
struct ImageHeader {
    std::string format;       ///< OpenImageIO's name of the format
    double bytes = 0;         ///< of the file
    bool has_display = false; ///< true if it says a display window
};

/// Looks at the header of an open file. Throws Error with the file's name for a format that
/// readImageFile() does not know, for a header that is damaged or promises more pixels than the
/// file's bytes can hold, and for kinds of a format that are refused: deep EXR, palettes and other
/// than 8, 16, 24 and 32 bits in TGA, BMP that is run-length coded.
ImageHeader checkImageHeader(const std::filesystem::path& file, std::FILE* stream);

/// Returns how many bytes of pixels a byte of the file can become at most, by the way in which the
/// format compresses: deflate 1032, LZW of 12 bits 2731, and so on. `compression` is the name that
/// OpenImageIO gives it, in lower case.
double mostBytesOfAByte(const std::string& format, const std::string& compression);

/// Throws Error if an image has no pixels, has more than the limits above, or if its pixels of
/// `pixel_bytes` bytes each cannot come out of a file of `header.bytes` bytes.
void checkImageSize(const std::filesystem::path& file, const ImageHeader& header,
                    std::int64_t width, std::int64_t height, double channels, double pixel_bytes,
                    const std::string& compression);

} // namespace volcomp
