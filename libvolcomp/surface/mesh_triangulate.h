// SPDX-License-Identifier: Apache-2.0
// Cuts a polygon in space into triangles.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "volcomp/base/vec.h"

namespace volcomp {

/// How triangulate() has cut a polygon.
enum class Cut {
    whole,
    crossed, ///< it crosses itself: the triangles are a fan from its first corner
    too_many ///< it is not convex and has more than kMostConcaveCorners: there are no triangles
};

/// The worst polygons of n corners take time in proportion to n^2, this many some seconds.
constexpr std::size_t kMostConcaveCorners = 20000;

/// Appends to `triangles` the corners, counted from 0, of triangles that cover the polygon, wound
/// as it is. It may be concave, and it may touch itself, as one with a hole does that is cut open.
/// It is seen along the axis to which it is most perpendicular. Three corners at least.
Cut triangulate(const std::vector<Vec3d>& polygon,
                std::vector<std::array<std::int32_t, 3>>& triangles);

} // namespace volcomp
