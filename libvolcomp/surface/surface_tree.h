// SPDX-License-Identifier: Apache-2.0
// Nearest points and crossings of a set of triangles, found with CGAL's AABB tree.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "volcomp/base/vec.h"

namespace volcomp {

/// An index of triangles; it keeps a copy of them. Triangles without area are left out, as nothing
/// stands on them. All const functions may be called by several threads at a time.
class SurfaceTree {
public:
    SurfaceTree(const std::vector<Vec3d>& points,
                const std::vector<std::array<std::int32_t, 3>>& triangles);
    ~SurfaceTree();
    SurfaceTree(SurfaceTree&&) noexcept;

    /// A point of the triangles.
    struct Nearest {
        Vec3d position;
        std::int32_t triangle = -1; ///< -1: there is no triangle with an area
    };
    /// The point of the triangles that is nearest to `p`.
    Nearest nearest(const Vec3d& p) const;

    /// Where a line meets a triangle.
    struct Hit {
        double t; ///< position = origin + t direction
        std::int32_t triangle;
    };
    /// Every triangle that the line crosses, from the largest t to the smallest; if `ray` is true,
    /// only t >= 0. Crossings are decided exactly, so a line through a common edge misses neither
    /// neighbour. Hits that are closer together than 1e-9 of the tree's size are one sheet, and
    /// only the first of them is returned. Triangles that contain the line are left out.
    std::vector<Hit> crossings(const Vec3d& origin, const Vec3d& direction, bool ray) const;

    /// The indices, in rising order, of the triangles that the line through (x, y, 0) along z
    /// meets, decided exactly. For triangles that lie in the plane z = 0.
    std::vector<std::int32_t> covering(double x, double y) const;

private:
    struct Impl;
    std::unique_ptr<Impl> m_impl;
};

} // namespace volcomp
