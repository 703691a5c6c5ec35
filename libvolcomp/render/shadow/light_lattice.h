// The rays that a light is swept along: a square lattice on every plane across one axis of the
// grid.
//
// Travel coordinate s: the light's axis, counted the way the light goes (-x where it goes towards
// -x). A ray (u, v) crosses the plane at s at b = origin_b + slope_b (s - s0) + u spacing(s), c
// likewise. Rays of a directional light are parallel and their spacing is the same everywhere;
// those of a point are a pyramid around one axis (slopes of 45 degrees at most), six of them all
// around, and spread. Corner coordinates, in voxels.
#pragma once

#include <algorithm>
#include <cmath>

#include "volcomp/base/vec.h"

namespace volcomp {

/// The rays of one light and the planes across them where their light is kept.
struct LightLattice {
    int a = 0, b = 1, c = 2; ///< the light's axis and the others
    int sign = 1;            ///< the light goes towards +a or -a
    bool fans = false;       ///< rays start in one point
    double s0 = 0;           ///< of that point; 0 for parallel rays
    double origin[2] = {0, 0}, slope[2] = {0, 0};
    double spacing0 = 1, spacing1 = 0;

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
    /// The pyramid around an axis; setSpacing() before use.
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
    /// The spacing at s, and less nearer to the light.
    void setFanSpacing(double spacing, double s)
    {
        spacing0 = 0;
        spacing1 = spacing / std::max(s - s0, 1.0);
    }

    double travel(const Vec3d& p) const { return sign * p[a]; }
    double spacing(double s) const { return spacing0 + spacing1 * (s - s0); }
    /// Where ray u crosses the plane at s, axis 0 (b) or 1 (c).
    double at(int axis, double u, double s) const
    {
        return origin[axis] + slope[axis] * (s - s0) + u * spacing(s);
    }
    /// The ray through x on the plane at s; for a fan s > s0.
    double rayThrough(int axis, double x, double s) const
    {
        return offsetFrom(axis, x, s) / spacing(s);
    }
    double offsetFrom(int axis, double x, double s) const
    {
        return x - origin[axis] - slope[axis] * (s - s0);
    } ///< ray 0
    /// Along b or c while one unit of s.
    double slopeOf(int axis, double u) const { return slope[axis] + u * spacing1; }

    /// The rays through a box: u from low to high, for s in [s_low, s_high] (a fan: above s0) and x
    /// in [x_low, x_high].
    void raysThrough(int axis, double x_low, double x_high, double s_low, double s_high,
                     double& low, double& high) const
    {
        if (fans) s_low = std::max(s_low, s0 + 1e-3);
        const double u[4] = {rayThrough(axis, x_low, s_low), rayThrough(axis, x_low, s_high),
                             rayThrough(axis, x_high, s_low), rayThrough(axis, x_high, s_high)};
        low = *std::min_element(u, u + 4);
        high = *std::max_element(u, u + 4);
    }

private:
    void setAxis(int axis)
    {
        a = axis;
        b = axis == 0 ? 1 : 0;
        c = axis == 2 ? 1 : 2;
    }
};

} // namespace volcomp
