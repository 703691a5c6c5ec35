// SPDX-License-Identifier: Apache-2.0
// A scene's geometry before any voxel: the segments that baking would turn into voxels, and where
// composing would stand them.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "volcomp/bake/mesh_model.h"
#include "volcomp/base/progress.h"
#include "volcomp/compose/voxel_tint.h"
#include "volcomp/grow/grow.h"
#include "volcomp/place/placed_scene.h"
#include "volcomp/scene/scene.h"

namespace volcomp {

/// Strands and flat pieces in their boxes, the boxes' places, and the skins. It can be moved, but
/// not copied. World space and world units; the boxes are in box space, metres.
struct ExactScene {
    Scene scene;
    std::vector<Skeleton> boxes; ///< by Placement::box: the variants of each kind, kind after kind
    /// The same for boxes of meshes, whose skeletons are empty; null for those that are grown.
    std::vector<std::shared_ptr<const MeshModel>> meshes;
    std::vector<std::string> warnings; ///< of meshes, one sentence each
    PlacedScene placed;

    /// Of all placements together: segments, and triangles of meshes.
    std::size_t segmentCount() const;
    /// The material of that name. Throws Error if the scene has none.
    const Material& material(const std::string& name) const;
    /// The colour that is looked up at each place of a placement; without a colour if it has none.
    VoxelTint tintOf(std::size_t placement) const;
};

/// Grows the boxes that the scene's layers use, and places them. Throws Error as grow() and place()
/// do.
ExactScene makeExactScene(Scene scene, const Progress& progress = {});

/// A vector of a box as it is turned in the world, without the placement's scale.
inline Vec3d turnedBy(const Placement& p, const Vec3f& v)
{
    return Vec3d(p.x_axis * v[0] + p.y_axis * v[1] + p.z_axis * v[2]);
}

} // namespace volcomp
