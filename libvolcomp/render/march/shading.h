// SPDX-License-Identifier: Apache-2.0
// What one voxel sends to the eye before anything else takes light away (MODEL sections 4 and 5).
#pragma once

#include <optional>
#include <vector>

#include "volcomp/render/march/march_scene.h"

namespace volcomp {

/// A voxel that a ray sees, and how much of what the ray sees there is that voxel's: 1 with the box
/// filter; with the trilinear filter the shares of eight voxels add up to 1.
struct SeenVoxel {
    int leaf, voxel; ///< `voxel` is the offset in the leaf (VoxelTree::offset())
    int cell[3];     ///< its lowest corner, corner coordinates
    double share = 1;
};

/// What the voxels of one segment send to the eye, as radiance that an opaque segment would show
/// with nothing between it and the lights.
struct Shading {
    Vec3d ambient{0.0};            ///< of the light from all around
    std::vector<Vec3d> from_light; ///< by light: of its strength, falloff and the reflection
    /// By light: how far towards it its light is measured, voxels, so that a strand does not shade
    /// itself (MODEL section 3).
    std::vector<double> light_start;
    // With MarchScene::bounces():
    Vec3d bounced{0.0};          ///< share of the light that is scattered, to any side
    std::vector<Vec3d> arriving; ///< by light: its strength and falloff, times the root of how much
                                 ///< of it meets something, over the mean of all directions
    /// Of the light from all around, for all voxels of the segment, if one has asked for it.
    std::optional<SkyAtPlace> sky;
    // With RenderParams::aovs:
    Vec3d albedo{0.0}; ///< alpha c_b
    Vec3d normal{0.0}; ///< mean direction, turned to the eye; not unit length
    /// The voxels that were shaded, if an observer wants them (RayObserver).
    std::vector<SeenVoxel> voxels;
    bool keep_voxels = false;

    /// Forgets the last segment.
    void start(std::size_t lights);
};

/// Adds what a voxel shows. p (corner coordinates) is where the light falls, V the unit direction
/// to the eye (world).
void shadeVoxel(const MarchScene& scene, const SeenVoxel& seen, const Vec3d& p, const Vec3d& V,
                Shading& shading);

} // namespace volcomp
