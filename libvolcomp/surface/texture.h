// SPDX-License-Identifier: Apache-2.0
// An image that maps look up, read by OpenImageIO.
#pragma once

#include <filesystem>
#include <vector>

#include "volcomp/base/vec.h"

namespace volcomp {

/// What an image shows outside of the unit square of (u,v).
enum class Wrap {
    repeat,
    clamp,  ///< the pixel at the border
    mirror, ///< itself, mirrored at each border
    black   ///< 0
};

/// Pixels as floats; integers of n bits become x / (2^n - 1). Rows run from the top down while v
/// grows upwards, so pixel (x, y) has its centre at u = (x + 1/2) / width, v = 1 - (y + 1/2) /
/// height.
struct Texture {
    int width = 0, height = 0, channels = 0;
    std::vector<float> pixels; ///< finite; row by row, the channels of a pixel together

    /// Bilinear interpolation of one channel. A channel that the image lacks is 1 if it is the
    /// fourth (alpha), otherwise the first channel (grey). Returns 0 if u or v is not below 1e9.
    float sample(double u, double v, int channel, Wrap wrap) const;

    /// The same for the first three channels, or three times the first if there are fewer.
    Vec3f colour(double u, double v, Wrap wrap) const;
};

/// Reads the first image of a file. If `to_linear` is true and the file holds 8 bits or says that
/// it is sRGB, colours are converted from sRGB to linear RGB. Alpha is not multiplied in. Throws
/// Error for a missing, foreign or truncated file, and for NaN and infinity.
Texture readTexture(const std::filesystem::path& file, bool to_linear);

} // namespace volcomp
