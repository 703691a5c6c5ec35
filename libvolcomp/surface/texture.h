// SPDX-License-Identifier: Apache-2.0
// An image that maps look up.
#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

#include "volcomp/base/image_file.h"
#include "volcomp/base/vec.h"

namespace volcomp {

/// What an image shows outside of the unit square of (u,v).
enum class Wrap {
    repeat,
    clamp,  ///< the pixel at the border
    mirror, ///< itself, mirrored at each border
    black   ///< 0
};

/// Pixels as floats; integers of n bits become x / (2^n - 1). (u,v) from 0 to 1 is the picture that
/// people see (the file's display window), of width x height pixels. Rows run from the top down
/// while v grows upwards, so pixel (x, y) has its centre at u = (x + 1/2) / width, v = 1 -
/// (y + 1/2) / height.
struct Texture {
    int width = 0, height = 0, channels = 0;
    /// The part of the picture that the file has pixels for; the others are 0, alpha too.
    PixelWindow data;
    std::vector<float> pixels; ///< of `data`, finite; by rows, the channels of a pixel together

    /// Bilinear interpolation of one channel. A channel that the image lacks is 1 if it is the
    /// fourth (alpha), otherwise the first channel (grey). Returns 0 if u or v is not below 1e9.
    float sample(double u, double v, int channel, Wrap wrap) const;

    /// The same for the first three channels, or three times the first if there are fewer.
    Vec3f colour(double u, double v, Wrap wrap) const;
};

/// Reads the first image of a file, as readImageFile() of base/image_file.h does. If `to_linear` is
/// true, the image holds colours and becomes linear RGB, by what the file says of its colours;
/// otherwise it holds data, such as sizes and directions, which are taken as they are. Alpha is
/// neither converted nor multiplied in. Throws the Errors of readImageFile(), and Error for NaN and
/// infinity.
Texture readTexture(const std::filesystem::path& file, bool to_linear);
/// The same of an image inside another file, as readImageBytes().
Texture readTexture(const std::filesystem::path& file, std::string_view bytes, bool to_linear);

} // namespace volcomp
