// Nearest points of a surface for many places close together: a walk from triangle to triangle.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "volcomp/surface/mesh.h"
#include "volcomp/base/vec.h"

namespace volcomp {

/// Nearest points on a mesh, found by walking over its triangles from one that is near.
class SurfaceWalk {
public:
    SurfaceWalk() = default;
    /// Corners at the same place are one vertex. Where more than two triangles share an edge, the
    /// first two are neighbours; triangles that are but an edge are nobody's.
    explicit SurfaceWalk(const Mesh& mesh);

    /// The nearest point that a walk has found.
    struct Foot {
        std::int32_t triangle;
        double b1, b2;    ///< weights of its second and third corner
        double distance2; ///< squared
    };
    /// Goes from triangle `start` to neighbours as long as that leads nearer to `p`: the nearest
    /// point of the part of the surface that lies downhill, so that a hair's tip beside a fold
    /// keeps to the side on which the hair stands. `mesh` is the constructor's.
    Foot nearest(const Mesh& mesh, const Vec3d& p, std::int32_t start) const;

private:
    std::vector<std::array<std::int32_t, 3>> m_vertices; ///< of each triangle
    std::vector<std::array<std::int32_t, 3>>
        m_neighbours; ///< across the edge from corner i to the next; -1: none
};

} // namespace volcomp
