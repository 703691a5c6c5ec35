// Nearest points and crossings on a triangle soup, by CGAL's AABB tree.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "volcomp/base/vec.h"

namespace volcomp {

/// Triangles without area are left out: nothing stands on them. All questions may be asked from
/// several threads at a time.
class SurfaceTree {
public:
    SurfaceTree(const std::vector<Vec3d>& points,
                const std::vector<std::array<std::int32_t, 3>>& triangles);
    ~SurfaceTree();
    SurfaceTree(SurfaceTree&&) noexcept;

    /// The point of the surface that is closest to another.
    struct Nearest {
        Vec3d position;
        std::int32_t triangle = -1; ///< -1: there is no triangle with an area
    };
    Nearest nearest(const Vec3d& p) const;

    /// Where a ray meets the surface.
    struct Hit {
        double t; ///< position = origin + t direction
        std::int32_t triangle;
    };
    /// Every triangle that the line (t >= 0 where `ray`) crosses, by falling t. Crossings are
    /// decided exactly: a line through a common edge misses neither neighbour. Hits closer than
    /// 1e-9 of the tree's size are one sheet and counted once. Triangles that hold the line itself
    /// are left out.
    std::vector<Hit> crossings(const Vec3d& origin, const Vec3d& direction, bool ray) const;

    /// Triangles that the line through `p` along z meets, by their index: for meshes that lie in
    /// the plane z = 0. Decided exactly.
    std::vector<std::int32_t> covering(double x, double y) const;

private:
    struct Impl;
    std::unique_ptr<Impl> m_impl;
};

} // namespace volcomp
