// SPDX-License-Identifier: Apache-2.0
// Vectors across a direction.
#pragma once

#include <cmath>
#include <utility>

#include "volcomp/base/vec.h"

namespace volcomp {

/// Two unit vectors across `axis` (unit) and across each other.
inline std::pair<Vec3d, Vec3d> across(const Vec3d& axis)
{
    const Vec3d b = axis.cross(std::abs(axis[0]) < 0.6 ? Vec3d(1, 0, 0) : Vec3d(0, 1, 0)).unit();
    return {b, axis.cross(b)};
}

} // namespace volcomp
