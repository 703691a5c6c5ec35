// SPDX-License-Identifier: Apache-2.0
// Where a line runs through a box: the slab method (Kay and Kajiya, Ray tracing complex scenes,
// SIGGRAPH 1986).
#pragma once

#include <algorithm>

#include "volcomp/base/interval.h"
#include "volcomp/base/vec.h"

namespace volcomp {

/// A part of a line: the points origin + t direction with begin <= t <= end.
struct LineRange {
    double begin, end;
};

/// Returns the part of `range` in which the line origin + t direction is inside the box [low,
/// high). Begin is above or at the end if there is none. A line that runs in the plane of a face is
/// inside at the low face and outside at the high one. The direction need not be of unit length.
inline LineRange clippedToBox(LineRange range, const Vec3d& origin, const Vec3d& direction,
                              const Vec3d& low, const Vec3d& high)
{
    for (int k = 0; k < 3; ++k) {
        if (direction[k] == 0) {
            if (origin[k] < low[k] || origin[k] >= high[k]) return {kInfinity, -kInfinity};
            continue;
        }
        const double u = (low[k] - origin[k]) / direction[k],
                     v = (high[k] - origin[k]) / direction[k];
        range.begin = std::max(range.begin, std::min(u, v));
        range.end = std::min(range.end, std::max(u, v));
    }
    return range;
}

} // namespace volcomp
