// SPDX-License-Identifier: Apache-2.0
// Where the samples of a pixel lie: the reconstruction filter, by importance sampling.
//
// The samples of a pixel are distributed by the filter's weight (Ernst, Stamminger, Greiner: Filter
// Importance Sampling, 2006). All samples count alike and none belongs to two pixels, so tiles stay
// independent, and alpha and other outputs are filtered as colour is.
#pragma once

#include <vector>

#include "volcomp/render/render_params.h"

namespace volcomp {

/// Where the samples of each pixel lie, so that their plain mean is the filtered picture.
class PixelSampler {
public:
    explicit PixelSampler(const RenderParams& params);

    /// The place of a sample of pixel (x, y), in pixels from the picture's top left corner; z is 0.
    /// A single sample lies in the pixel's centre. Several form a jittered grid; those for which a
    /// square grid has no room are random; all are warped by the filter. Each pixel takes the cells
    /// of the grid in a random order, so that the mean of its first samples is not to one side. The
    /// place depends on the arguments, the number of samples, the filter and the picture's width
    /// alone.
    Vec3d position(int x, int y, int sample) const;

    /// The offset from the pixel's centre, in pixels, below which the part u of the filter's weight
    /// lies; 0 <= u <= 1.
    double warp(double u) const;

private:
    int m_samples, m_side, m_width;
    double m_radius;
    /// warp() at even steps of u; empty for a box.
    std::vector<double> m_inverse;
};

/// Radius of the filter in pixels: what the parameters say, or its usual one.
double pixelRadius(const RenderParams& params);

/// A filter's weight at the fraction x of its radius: 1 in the middle, 0 if |x| > 1. The weights
/// are not normalised.
double pixelWeight(PixelFilter filter, double x);

} // namespace volcomp
