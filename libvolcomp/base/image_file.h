// SPDX-License-Identifier: Apache-2.0
// Images of other programs: what their files say and their pixels, whatever their bytes are.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace volcomp {

/// A rectangle of pixels: columns x to x + width - 1 and rows y to y + height - 1.
struct PixelWindow {
    int x = 0, y = 0, width = 0, height = 0;
};

/// How an image's numbers code colours.
enum class ColourCoding {
    linear,
    srgb,
    gamma ///< linear value = number ^ ImageFile::gamma
};

/// The first image of a file. Rows run from the top down.
struct ImageFile {
    int width = 0, height = 0; ///< of the display window: the picture that people see
    /// The part of the display window that the file has pixels for, counted from the display
    /// window's upper left corner. Pixels of the file outside of the display window are left out.
    PixelWindow data;
    std::vector<std::string> channels;
    int alpha_channel = -1; ///< -1: there is none
    /// Of `data`, row by row, the channels of a pixel together. Integers of n bits are divided by
    /// 2^n - 1; NaN and infinity stay.
    std::vector<float> pixels;
    /// What the file says (a PNG's sRGB and gAMA chunks, a TIFF's and a JPEG's Exif data). A file
    /// that says nothing is in sRGB if it holds integers, and linear if it holds floats. Embedded
    /// ICC profiles are not read.
    ColourCoding coding = ColourCoding::linear;
    double gamma = 1;
};

/// Makes the colours of an image linear, by what its file says of their coding. Alpha stays.
void makeLinear(ImageFile& image);

/// What becomes of colours that a PNG, TIFF or TGA stores beside their alpha.
enum class StoredAlpha { multiply, keep };

/// Reads PNG, EXR, TIFF, JPEG, HDR (Radiance), TGA, BMP, PNM (PBM, PGM, PPM, PFM) and GIF with
/// OpenImageIO. The bytes tell the format, except that a TGA needs its ending .tga. A file's name
/// may have any characters. Memory is taken only for what the file's bytes can hold. Throws Error
/// for a missing, foreign, damaged or truncated file, for an image that is not flat or has more
/// than 4e9 values, and if memory is not enough.
ImageFile readImageFile(const std::filesystem::path& file, StoredAlpha alpha);

/// The same of an image that stands inside another file: `file` names it in messages, `bytes` are
/// all of it.
ImageFile readImageBytes(const std::filesystem::path& file, std::string_view bytes,
                         StoredAlpha alpha);

} // namespace volcomp
