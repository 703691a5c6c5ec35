// SPDX-License-Identifier: Apache-2.0
// A triangle mesh, read from a file and mended, and a report of what was wrong with it.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <openvdb/math/Vec2.h>

#include "volcomp/base/vec.h"

namespace volcomp {

using Vec2d = openvdb::math::Vec2<double>;
using Vec2f = openvdb::math::Vec2<float>;

/// Which side of a mesh is outside. The normals of triangles wound counter-clockwise point there.
enum class Orientation {
    /// Triangles are turned so that neighbours agree; then a closed part faces outward, and an open
    /// part as most of its triangles do in the file.
    outward,
    file,  ///< as the file winds them
    inward ///< the opposite of outward
};

/// What readMesh() and prepareMesh() have found and mended.
struct MeshReport {
    std::vector<std::string> warnings;                  ///< one sentence each, with the file's name
    std::size_t vertices = 0, faces = 0, triangles = 0; ///< vertices and faces: as in the file
    std::size_t parts = 0;          ///< connected pieces; vertices at the same place count as one
    std::size_t boundary_edges = 0; ///< edges that belong to one triangle only
    std::size_t non_manifold_edges = 0; ///< edges that more than two triangles share
    std::size_t non_manifold_faces = 0; ///< triangles at such an edge; all of them are kept
    std::size_t zero_area = 0;          ///< triangles without area; no box stands on them
    std::size_t turned = 0;             ///< triangles whose winding was turned round
    bool normals_computed = false;      ///< true if the file had no normals
    bool has_uv = false;

    /// One line of text with everything that is worth saying.
    std::string text() const;
};

/// A material that a mesh file names. Nothing but its name is known if its library is missing.
struct MeshMaterial {
    std::string name;              ///< may be empty: PLY names textures alone
    std::filesystem::path texture; ///< of its diffuse colour (map_Kd); empty: none
    /// The bytes of the texture if the mesh's file holds them; `texture` is a name for messages
    /// then.
    std::shared_ptr<const std::string> embedded;
    std::filesystem::path alpha; ///< of its own (map_d); empty: none
    bool cut = false;            ///< cut out where alpha, the texture's or its own, is low
    double cutoff = 0.5;         ///< alpha below it counts as nothing
    /// Linear RGB: the colour, or a factor on the texture (glTF's baseColorFactor; OBJ's Kd counts
    /// without a texture alone).
    Vec3f colour{1.0f};
};

/// Successive triangles of one object or group, and of one material.
struct MeshPart {
    std::string name;               ///< OBJ: "object", "group" or "object/group"; STL: the
                                    ///< solid's; glTF: "node", "mesh" or "node/mesh"
    std::int32_t material = -1;     ///< index into Mesh::materials; -1: none
    std::size_t first = 0, end = 0; ///< its triangles, `end` excluded
};

/// Triangles over shared points. All values are finite.
struct Mesh {
    /// World units. At a hard edge, where the file gives one place several normals, a place has a
    /// point for each of them.
    std::vector<Vec3d> points;
    std::vector<std::array<std::int32_t, 3>> triangles;
    std::vector<Vec3f> normals; ///< one for each point, unit, or 0 if it has none
    /// Texture coordinates of each triangle's corners; empty if the mesh has none. Faces to which
    /// the file gives none have (0, 0) at all corners.
    std::vector<std::array<Vec2f, 3>> uv;
    std::vector<MeshPart> parts; ///< of a file: all triangles, in their order
    std::vector<MeshMaterial> materials;
    MeshReport report;
};

/// Reads OBJ, PLY, OFF, STL or glTF (.gltf, .glb): what each of the readers in mesh_soup.h says.
/// Polygons are cut into triangles; they may be concave. Throws Error for a missing, empty,
/// truncated or foreign file, for coordinates that are not finite and for what is not supported.
Mesh readMesh(const std::filesystem::path& file);

/// Multiplies all points by `scale` and adds `move`, turns triangles as `orientation` says, and
/// computes normals, weighted by angle, for points that have none. Adds what it finds to
/// mesh.report.
void prepareMesh(Mesh& mesh, double scale, const Vec3d& move, Orientation orientation);

} // namespace volcomp
