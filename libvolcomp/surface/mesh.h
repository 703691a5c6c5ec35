// A triangle mesh as a file holds it, and what is wrong with it.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <openvdb/math/Vec2.h>

#include "volcomp/base/vec.h"

namespace volcomp {

using Vec2d = openvdb::math::Vec2<double>;
using Vec2f = openvdb::math::Vec2<float>;

/// Which side of a mesh is outside.
enum class Orientation {
    outward, ///< faces turned to agree with their neighbours; closed parts outward, open parts as
             ///< most of their faces
    file,    ///< as the file winds them
    inward   ///< the opposite of outward
};

/// What readMesh() and orient() found and mended.
struct MeshReport {
    std::size_t vertices = 0, faces = 0, triangles = 0;
    std::size_t parts = 0;          ///< connected pieces (vertices at the same place count as one)
    std::size_t boundary_edges = 0; ///< of one face
    std::size_t non_manifold_edges = 0; ///< of more than two faces
    std::size_t non_manifold_faces = 0; ///< faces at such an edge; all of them are kept
    std::size_t zero_area = 0;          ///< triangles without area; no box stands on them
    std::size_t turned = 0;             ///< triangles whose winding was turned round
    bool normals_computed = false;      ///< the file had none
    bool has_uv = false;

    /// One line for a person.
    std::string text() const;
};

/// Triangles over shared points. All values are finite.
struct Mesh {
    std::vector<Vec3d> points; ///< world units
    std::vector<std::array<std::int32_t, 3>> triangles;
    std::vector<Vec3f> normals; ///< one for each point, unit or 0 where undefined
    std::vector<std::array<Vec2f, 3>>
        uv; ///< texture coordinates of each triangle's corners; empty: none
    MeshReport report;
};

/// Reads OBJ, PLY, OFF or STL by OpenMesh's readers, without its half-edge structure, which would
/// drop non-manifold faces. Polygons become triangles. Throws Error for a missing, empty, truncated
/// or foreign file and for coordinates that are not finite.
Mesh readMesh(const std::filesystem::path& file);

/// Multiplies by `scale`, then adds `move`; turns faces as `orientation` says; computes normals,
/// weighted by angle, where there are none.
void prepareMesh(Mesh& mesh, double scale, const Vec3d& move, Orientation orientation);

} // namespace volcomp
