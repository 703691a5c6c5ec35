// SPDX-License-Identifier: Apache-2.0
// What a mesh file says, before it becomes a Mesh: polygons over points; and the five readers.
//
// The readers are ours because those at hand fail with files that are legal, or with damaged ones.
// OpenMesh's hang, crash and take memory by what a header says, and round points to floats.
// tinyobjloader 2.0 refuses `f 1 2 3 # comment` and continued lines, reads `nan` and `1,5` as
// numbers, and counts a face of 300 corners as one of 44.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "volcomp/surface/mesh.h"

namespace volcomp {

/// Polygons over points, as the file has them.
struct PolygonSoup {
    struct Corner {
        std::int32_t point;
        std::int32_t uv = -1, normal = -1; ///< -1: the file gives none
    };
    /// The faces from `first_face` to the next range's.
    struct Range {
        std::string name;
        std::int32_t material; ///< -1: none
        std::size_t first_face;
    };

    std::vector<Vec3d> points;   ///< finite
    std::vector<Vec2f> uvs;      ///< finite
    std::vector<Vec3f> normals;  ///< of any length, may be NaN
    std::vector<Corner> corners; ///< of all faces; `point` and the others may be out of range
    std::vector<std::size_t> face_ends; ///< for each face the index behind its last corner
    std::vector<Range> ranges;          ///< may be empty
    std::vector<MeshMaterial> materials;
    std::vector<std::string> warnings; ///< whole sentences
    std::size_t short_faces = 0;       ///< faces of less than three corners, which are left out

    /// Ends the face of the corners that were added since the last call.
    void endFace();
    /// The faces that follow have this name and material.
    void startRange(const std::string& name, std::int32_t material);
};

/// The readers. `text` is the whole content of the file. They throw Error for anything that they do
/// not read right, and take memory in proportion to the text.
PolygonSoup readObj(const std::filesystem::path& file, std::string_view text);
PolygonSoup readPly(const std::filesystem::path& file, std::string_view text);
PolygonSoup readOff(const std::filesystem::path& file, std::string_view text);
/// glTF 2.0: the triangles of the default scene's nodes, in metres; both forms, JSON and GLB.
PolygonSoup readGltf(const std::filesystem::path& file, std::string_view text);
PolygonSoup readStl(const std::filesystem::path& file, std::string_view text);

} // namespace volcomp
