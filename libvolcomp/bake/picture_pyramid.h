// SPDX-License-Identifier: Apache-2.0
// What a piece of a picture shows in the mean: how much of it is there, and in what colour.
#pragma once

#include <cstddef>
#include <vector>

#include "volcomp/surface/mesh.h"
#include "volcomp/surface/texture.h"

namespace volcomp {

/// Means over squares of 1, 2, 4 ... texels. A texel is there if its alpha reaches the cut-off.
class PicturePyramid {
public:
    /// A piece of the picture.
    struct Mean {
        float share = 0;    ///< of its area that is there
        Vec3f colour{0.0f}; ///< linear RGB, mean over what is there; 0 if nothing is
    };

    /// `channel` is the texture's channel that cuts it out, -1 for none.
    PicturePyramid(const Texture& texture, int channel, double cutoff);

    /// The mean over about `texels` x `texels` texels (of the finest level) around (u,v); the
    /// picture repeats.
    Mean at(const Vec2d& uv, double texels) const;

    /// The number of texels each way.
    Vec2d size() const;

    /// The width that what is there has in the mean, texels: that of a rectangle with its area and
    /// the length of its border; 0 if nothing is cut out.
    double width() const { return m_width; }

private:
    struct Level {
        int width, height;
        std::vector<float> values; ///< share, then colour times share, of each texel; by rows
    };
    void measureWidth();
    std::vector<Level> m_levels;
    double m_width = 0;
};

/// The narrower side of a rectangle of this area and length of border. Where there is none, as a
/// disc has too short a border, that of a square of the area.
double widthOf(double area, double border);

} // namespace volcomp
