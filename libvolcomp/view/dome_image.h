// SPDX-License-Identifier: Apache-2.0
// The image of a dome: its texels, and where they lie in the sky.
#pragma once

#include <cstddef>
#include <filesystem>
#include <utility>
#include <vector>

#include "volcomp/base/vec.h"

namespace volcomp {

/// A lat-long image, width = 2 height, linear RGB, finite and >= 0. Rows run from straight up to
/// straight down; columns from +z by -x, -z (the middle) and +x back to +z.
struct DomeImage {
    int width = 0, height = 0;
    std::vector<Vec3f> texels; ///< row by row, without the suns
    /// What the texels are with the suns in them, by their number in `texels`, which grows.
    std::vector<std::pair<std::size_t, Vec3f>> suns;
    bool black = true; ///< all texels are 0 and there are no suns

    std::size_t placeOf(int column, int row) const
    {
        return static_cast<std::size_t>(row) * width + column;
    }
    double solidAngle(int row) const;          ///< of each texel of a row
    Vec3d direction(double x, double y) const; ///< of a place in texels, from the upper left corner
    /// Bilinear interpolation in the direction `d` (unit): around the horizon the image goes on at
    /// its other side, at the poles its first and last row go on.
    Vec3d at(const Vec3d& d, bool with_suns) const;
};

/// Reads the image and makes its colours linear, as readImageFile() and makeLinear() do. One
/// channel is grey, more are red, green and blue; alpha does not count. What the file has no pixels
/// for is black. Throws their Errors, and Error if the width is not twice the height, for two
/// channels of colour, and for values that are negative, infinite or NaN, with the first's place.
DomeImage readDomeImage(const std::filesystem::path& file);

/// The same light in few texels, for what looks at it from few directions: means over cells of 64 x
/// 32, or the image itself if it is not larger.
DomeImage coarseDome(const DomeImage& image);

} // namespace volcomp
