// Where the samples of a pixel lie: the reconstruction filter, by importance sampling.
//
// The samples of a pixel are spread as the filter weighs (filter importance sampling: Ernst,
// Stamminger, Greiner, 2006), so that all count alike and no sample belongs to two pixels: tiles
// stay independent, and alpha and AOVs are filtered as colour is.
#pragma once

#include <vector>

#include "volcomp/render/render_params.h"

namespace volcomp {

/// Where the samples of each pixel lie, so that their plain mean is the filtered picture.
class PixelSampler {
public:
    explicit PixelSampler(const RenderParams& params);

    /// A place in the picture, pixels from the top left corner (z is 0). One sample alone lies in
    /// the pixel's centre; otherwise a jittered grid, then what the grid has no room for at random,
    /// warped by the filter. A function of its arguments and the picture's width alone.
    Vec3d position(int x, int y, int sample) const;

    /// The offset from the pixel's centre below which lies the part u of the filter's weight, 0 <=
    /// u <= 1.
    double warp(double u) const;

private:
    int m_samples, m_side, m_width;
    double m_radius;
    std::vector<double> m_inverse; ///< of the distribution, evenly spaced in u; empty for a box
};

/// Radius of the filter: what the parameters say, or its usual one.
double pixelRadius(const RenderParams& params);

/// A filter's weight at x of its radius, |x| <= 1, not normalised: 1 in the middle.
double pixelWeight(PixelFilter filter, double x);

} // namespace volcomp
