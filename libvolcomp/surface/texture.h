// A picture that is looked up, read by OpenImageIO.
#pragma once

#include <filesystem>
#include <vector>

#include "volcomp/base/vec.h"

namespace volcomp {

enum class Wrap {
    repeat,
    clamp, ///< the border's pixel goes on
    mirror,
    black ///< 0 outside
};

/// Pixels as floats: integers of n bits become x / (2^n - 1). Texel (x, y) has its centre at ((x +
/// 1/2) / width, 1 - (y + 1/2) / height): rows run from the top, v upwards.
struct Texture {
    int width = 0, height = 0, channels = 0;
    std::vector<float> pixels; ///< finite

    /// Bilinear. A channel that the picture lacks is 1 if it is the fourth (alpha), else the first
    /// one (grey).
    float sample(double u, double v, int channel, Wrap wrap) const;

    /// The first three channels, or the first one three times.
    Vec3f colour(double u, double v, Wrap wrap) const;
};

/// Reads the file's first picture; its colours are converted from sRGB to linear where `to_linear`
/// and the file holds 8 bit or says sRGB. Alpha is not multiplied in. Throws Error for a missing,
/// foreign or truncated file, NaN and infinity.
Texture readTexture(const std::filesystem::path& file, bool to_linear);

} // namespace volcomp
