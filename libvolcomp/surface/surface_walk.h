// SPDX-License-Identifier: Apache-2.0
// Nearest points of a surface for many places that are close together, found by walking from
// triangle to triangle.
#pragma once

#include <cstdint>
#include <memory>

#include "volcomp/surface/mesh.h"
#include "volcomp/base/vec.h"

namespace volcomp {

/// Nearest points on a mesh, found by walking over its triangles from one that is near.
class SurfaceWalk {
public:
    SurfaceWalk() = default;
    /// Corners at the same place are one vertex. If more than two triangles share an edge, the
    /// first two are neighbours. Degenerate triangles, two of whose corners are one vertex, have no
    /// neighbours, and a triangle has none that is wound against those that come before it and
    /// cannot be turned to fit them.
    explicit SurfaceWalk(const Mesh& mesh);

    /// The nearest point that a walk has found.
    struct Foot {
        std::int32_t triangle;
        double b1, b2;    ///< weights of its second and third corner
        double distance2; ///< its squared distance from the place
    };
    /// Goes from triangle `start` to its neighbours, and on, as long as that leads nearer to `p`.
    /// It may so end at a local minimum, which is wanted: a hair's tip beside a fold keeps to the
    /// side on which the hair stands. `mesh` must be the constructor's.
    Foot nearest(const Mesh& mesh, const Vec3d& p, std::int32_t start) const;

private:
    class Step;
    struct Links;
    /// Looks at the triangles around a corner. Returns true if the surface ends there.
    bool lookAround(Step& step, std::int32_t triangle, int corner) const;
    std::shared_ptr<const Links> m_links; ///< copies share it; null: made without a mesh
};

} // namespace volcomp
