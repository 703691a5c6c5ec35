// SPDX-License-Identifier: Apache-2.0
// The rays that a light is swept along: a square lattice on every plane across one axis of the
// grid.
//
// The travel coordinate s counts along the light's axis in the direction in which the light goes:
// s = x, or s = -x if the light goes towards -x. Ray (u, v) crosses the plane at s at
// b = origin_b + slope_b (s - s0) + u spacing(s), and at c likewise. The rays of a directional
// light are parallel, with the same spacing everywhere. The rays of a point light form pyramids
// around the axes, with slopes of 45 degrees at most; six pyramids cover all directions, and their
// spacing grows with the distance. All coordinates are corner coordinates (voxel_tree.h), in
// voxels.
#pragma once

#include <algorithm>
#include <cmath>

#include "volcomp/base/vec.h"

namespace volcomp {

/// The rays of one light and the planes across them on which its light is kept.
struct LightLattice {
    int a = 0, b = 1, c = 2; ///< the light's axis, and the two others in ascending order
    int sign = 1;            ///< 1 if the light goes towards +a, -1 if towards -a
    bool fans = false;       ///< true if all rays start in one point
    double s0 = 0;           ///< s of that point; 0 for parallel rays
    double origin[2] = {0, 0}, slope[2] = {0, 0}; ///< of ray (0, 0), along b and c
    double spacing0 = 1, spacing1 = 0;            ///< spacing(s) = spacing0 + spacing1 (s - s0)

    /// The rays of a directional light that goes in `direction` (unit length), `spacing` apart.
    static LightLattice parallel(const Vec3d& direction, double spacing)
    {
        LightLattice l;
        l.setAxis(largestAxis(direction));
        l.sign = direction[l.a] > 0 ? 1 : -1;
        l.slope[0] = direction[l.b] / std::abs(direction[l.a]);
        l.slope[1] = direction[l.c] / std::abs(direction[l.a]);
        l.spacing0 = spacing;
        return l;
    }
    /// The pyramid of a point light around the half axis `sign` times `axis`. Call setFanSpacing()
    /// before anything else is asked of it.
    static LightLattice fan(const Vec3d& position, int axis, int sign)
    {
        LightLattice l;
        l.setAxis(axis);
        l.sign = sign;
        l.fans = true;
        l.s0 = sign * position[axis];
        l.origin[0] = position[l.b];
        l.origin[1] = position[l.c];
        return l;
    }
    /// Makes the spacing `spacing` at s, and proportionally less nearer to the light.
    void setFanSpacing(double spacing, double s)
    {
        spacing0 = 0;
        spacing1 = spacing / std::max(s - s0, 1.0);
    }

    /// Moves parallel rays so that they keep away from the faces of voxels, as far as their spacing
    /// allows; for rays 2/3 voxel apart that is 1/6 voxel. They do so on the plane at 0, where the
    /// volume's size makes no difference, and along an `axis` (0: b, 1: c) on the plane at s: rays
    /// along an axis then lie inside of a column of voxels.
    void keepOffFaces() { origin[0] = origin[1] = 0.25 * spacing0; }
    void keepOffFaces(int axis, double s) { origin[axis] = 0.25 * spacing0 - slope[axis] * s; }

    double travel(const Vec3d& p) const { return sign * p[a]; } ///< s of a point
    double spacing(double s) const { return spacing0 + spacing1 * (s - s0); }
    /// Whether a plane at s has rays: a fan's begin a little behind its point.
    bool hasRaysAt(double s) const { return !fans || s > s0 + kFanStart; }
    /// The coordinate along b (axis 0) or c (axis 1) at which ray u crosses the plane at s.
    double at(int axis, double u, double s) const
    {
        return origin[axis] + slope[axis] * (s - s0) + u * spacing(s);
    }
    /// The distance of x from ray 0 on the plane at s, along axis 0 (b) or 1 (c).
    double offsetFrom(int axis, double x, double s) const
    {
        return x - origin[axis] - slope[axis] * (s - s0);
    }
    /// The number of the ray, not rounded, that crosses the plane at s at x; hasRaysAt(s).
    double rayThrough(int axis, double x, double s) const
    {
        return offsetFrom(axis, x, s) / spacing(s);
    }
    /// How far ray u goes along b (axis 0) or c (axis 1) while it travels one unit of s.
    double slopeOf(int axis, double u) const { return slope[axis] + u * spacing1; }

    struct Range {
        double low, high;
    };
    /// The numbers of the rays that pass a rectangle of s in [s_low, s_high] and x in [x_low,
    /// x_high], along axis 0 (b) or 1 (c). The part of a fan's rectangle before its rays begin is
    /// left out.
    Range raysThrough(int axis, double x_low, double x_high, double s_low, double s_high) const
    {
        if (fans) s_low = std::max(s_low, s0 + kFanStart);
        const auto [low, high] =
            std::minmax({rayThrough(axis, x_low, s_low), rayThrough(axis, x_low, s_high),
                         rayThrough(axis, x_high, s_low), rayThrough(axis, x_high, s_high)});
        return {low, high};
    }

private:
    static constexpr double kFanStart = 1e-3; ///< voxels behind the point in which rays start

    void setAxis(int axis)
    {
        a = axis;
        b = axis == 0 ? 1 : 0;
        c = axis == 2 ? 1 : 2;
    }
};

} // namespace volcomp
