// SPDX-License-Identifier: Apache-2.0
// Cuts a polygon in space into triangles.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "volcomp/base/vec.h"

namespace volcomp {

/// Appends to `triangles` the corners, counted from 0, of triangles that cover the polygon, wound
/// as it is. It may be concave, and it may touch itself, as one with a hole does that is cut open.
/// It is seen along the axis to which it is most perpendicular. Returns false if it crosses itself
/// there: then the triangles are a fan from its first corner. Three corners at least.
bool triangulate(const std::vector<Vec3d>& polygon,
                 std::vector<std::array<std::int32_t, 3>>& triangles);

} // namespace volcomp
