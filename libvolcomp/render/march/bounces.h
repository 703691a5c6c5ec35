// SPDX-License-Identifier: Apache-2.0
// The light that is scattered more than once (MODEL section 5b).
#pragma once

#include <algorithm>
#include <cmath>

#include "volcomp/base/vec.h"

namespace volcomp {

/// Fitted to paths through fur, for P of cells of 8 voxels and 6 directions, and kept for 26, with
/// which they were measured (docs/rendering.md), not fitted anew.
constexpr double kMeetsAgain = 0.80, kFades = 1.20;

/// What a place shows of light that was scattered more than once, over the strength of the light,
/// if particles take the light from all sides alike. `albedo` is the share of light that a particle
/// scatters, `closed` is P (Openness::closed()), `depth` the optical depth to the light, which may
/// be infinite. An albedo above 1 counts as 1.
///
/// Light that is scattered meets something again with the probability P, a little less on its way
/// to the surface, and goes on with the albedo: a geometric series. It fades with the depth as in
/// two-stream theory, by what each scattering loses.
inline double lightOfBounces(double albedo, double closed, double depth)
{
    const double a = std::min(1.0, albedo), root = std::sqrt(closed),
                 w = kMeetsAgain * a * root * std::sqrt(root); // P^(3/4)
    if (!(w > 0) || !(depth < 1e300)) return 0;
    const double lost = std::sqrt(std::max(0.0, 1 - a * closed)),
                 k = kFades * std::sqrt(lost * std::sqrt(lost)); // (1 - a P)^(3/8)
    return 0.25 * a * w / (1 - w) * std::exp(-k * depth);
}
inline Vec3d lightOfBounces(const Vec3d& albedo, double closed, double depth)
{
    const double red = lightOfBounces(albedo[0], closed, depth);
    if (albedo[1] == albedo[0] && albedo[2] == albedo[0]) return Vec3d(red);
    return {red, lightOfBounces(albedo[1], closed, depth),
            lightOfBounces(albedo[2], closed, depth)};
}

} // namespace volcomp
