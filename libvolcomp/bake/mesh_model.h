// SPDX-License-Identifier: Apache-2.0
// A modelled box as its file has it, before any voxel: triangles in metres with what they are made
// of. Baking fills voxels with it, and volcomp-truth traces it.
//
// The triangles of one material hang together in sheets, by edges at the same places. A sheet is a
// body, which is filled inside, if its `solidity` says so; left to itself, if the holes in it, each
// closed by triangles around the mean of its border, have less than a quarter of its area. So
// trunks and branches that are open at their ends are bodies, and cards and leaves are not.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "volcomp/bake/picture_pyramid.h"
#include "volcomp/grow/growth_rule.h"
#include "volcomp/surface/texture.h"
#include "volcomp/volume/material.h"

namespace volcomp {

/// How some triangles look.
struct MeshLook {
    Vec3f colour{1.0f};                     ///< linear RGB, a factor on the texture
    std::shared_ptr<const Texture> texture; ///< linear RGB; null: none
    std::shared_ptr<const Texture> alpha;   ///< null: nothing is cut out; may be `texture`
    int alpha_channel = 3;                  ///< of `alpha`
    double cutoff = 0.5;
    std::shared_ptr<const PicturePyramid> picture; ///< of texture; cut out if alpha is the same
    std::shared_ptr<const PicturePyramid> cut;     ///< of alpha, if that is another picture

    /// The colour, and whether there is anything, at one place.
    Vec3f colourAt(const Vec2d& uv) const;
    bool isThere(const Vec2d& uv) const;
    /// The mean over a piece of area `uv_area` around uv, (u,v) units.
    PicturePyramid::Mean mean(const Vec2d& uv, double uv_area) const;
    bool hasPicture() const { return picture || cut; }
};

/// One triangle, box space.
struct ModelTriangle {
    std::array<Vec3d, 3> corners;
    std::array<Vec2f, 3> uv;
    std::int32_t look;   ///< index into MeshModel::looks
    std::uint32_t sheet; ///< index into the part's sheets
};

/// Triangles that hang together.
struct MeshSheet {
    bool solid = false;
    /// How many triangles lie on each other: 2 if a sheet has no border, as cards have that were
    /// modelled with a back of their own.
    int sides = 1;
    /// In the mean, metres: of the rectangle with its area and border, or of what its picture
    /// leaves of it; of a body half the root of its area.
    double width = 0;
};

/// All triangles of one material of the scene.
struct MeshModelPart {
    std::string material;
    std::vector<ModelTriangle> triangles; ///< sheet by sheet
    std::vector<MeshSheet> sheets;
    /// Triangles that close the bodies' holes: they belong to the inside alone.
    std::vector<std::array<Vec3d, 3>> caps;
};

struct MeshModel {
    std::vector<MeshModelPart> parts; ///< in the order of the scene's materials
    std::vector<MeshLook> looks;
    std::vector<std::string> warnings; ///< one sentence each

    std::size_t triangleCount() const;
};

/// Reads the mesh and the pictures of a rule's mesh box. Throws Error as readMesh() and
/// readTexture(), and if a pattern of the rule matches nothing in the file.
MeshModel loadMeshModel(const GrowthRule& rule, const std::vector<Material>& materials);

} // namespace volcomp
