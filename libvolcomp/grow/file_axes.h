// SPDX-License-Identifier: Apache-2.0
// How the lengths and axes of another program's file become metres with +Y up.
#pragma once

#include <optional>

#include "volcomp/base/vec.h"

namespace volcomp {

/// Which direction of a file is up.
enum class UpAxis { x, y, z };

/// What a scene says of a file.
struct FileAxes {
    double scale = 0;         ///< metres in one unit of the file; 0: as the file says, otherwise 1
    std::optional<UpAxis> up; ///< none: as the file says, otherwise y
};

/// Turns a vector of a file so that its up axis becomes +Y.
inline Vec3d turnedUp(UpAxis up, const Vec3d& v)
{
    if (up == UpAxis::x) return Vec3d(-v[1], v[0], v[2]);
    if (up == UpAxis::z) return Vec3d(v[0], v[2], -v[1]);
    return v;
}

} // namespace volcomp
