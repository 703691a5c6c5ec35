// SPDX-License-Identifier: Apache-2.0
// A picture in memory, and reading and writing it.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "volcomp/view/tone.h"

namespace volcomp {

/// Linear, scene-referred pixels, row by row from the top left, channels interleaved. A copy has
/// pixels of its own.
struct Image {
    int width = 0, height = 0;
    std::vector<std::string> channels; ///< names: R, G, B, A (premultiplied), Z, ...
    std::vector<float> pixels;         ///< width * height * channels.size()

    /// The channels of the pixel in column x (0 to width - 1) and row y (0 to height - 1).
    float* pixel(int x, int y)
    {
        return &pixels[(static_cast<std::size_t>(y) * width + x) * channels.size()];
    }
    const float* pixel(int x, int y) const
    {
        return &pixels[(static_cast<std::size_t>(y) * width + x) * channels.size()];
    }
};

/// Returns true for a name that ends in .exr, false for .png, in any case of letters. Throws Error
/// for another ending: a program calls it before the work that the picture shows.
bool requirePictureName(const std::filesystem::path& file);

/// Reads a picture, as readImageFile() of base/image_file.h does: its display window, with 0 where
/// the file has no pixels. Values are as the file stores them: EXR is linear, PNG is in sRGB, 0 to
/// 1. The colours of a PNG are multiplied with its alpha. Throws its Errors, and Error if the
/// display window is much larger than the data.
Image readImage(const std::filesystem::path& file);

/// Writes .exr (all channels as 32-bit floats) or .png (R, G, B and A in sRGB, 8 bit; without A if
/// all pixels are opaque), by the name's ending, with `metadata` as names and values. PNG stores
/// colours that are not multiplied by alpha, as `look` shows them; EXR is left as it is. The file
/// appears when it is complete. Throws Error for another ending or a file that cannot be written.
/// `image.pixels` must have the size that Image says.
void writeImage(const std::filesystem::path& file, const Image& image,
                const std::vector<std::pair<std::string, std::string>>& metadata = {},
                const Look& look = {});

} // namespace volcomp
