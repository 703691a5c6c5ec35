// SPDX-License-Identifier: Apache-2.0
// The coarser levels of a volume that a camera needs (MODEL section 8).
#pragma once

#include <memory>
#include <vector>

#include "volcomp/base/interval.h"
#include "volcomp/render/render_params.h"
#include "volcomp/render/tree/voxel_tree.h"
#include "volcomp/view/camera.h"

namespace volcomp {

/// Voxels for a range of distances.
struct VoxelLevel {
    std::shared_ptr<const VoxelTree> tree;
    /// Distances from the camera, world units.
    double start = 0, end = kInfinity;
    /// Voxels of the same particles, as wide or wider, from which the level's openness is found;
    /// null: from the finest level's. With a maker, what of them is needed is made.
    std::shared_ptr<const VoxelTree> around = nullptr;
};

/// The trees of makers of the same particles, finest first, each of twice the voxels' width of the
/// one before. They share `budget`.
std::vector<std::shared_ptr<const VoxelTree>>
tileTrees(const std::vector<std::shared_ptr<const TileMaker>>& makers,
          const std::shared_ptr<TileBudget>& budget);

/// The levels of such trees for a camera, with voxels of at most `voxel_pixels` pixels where they
/// are looked at; the last serves all distances behind. What was made for another camera is used
/// again. Throws Error if there is no tree.
std::vector<VoxelLevel> tileLevels(const std::vector<std::shared_ptr<const VoxelTree>>& trees,
                                   const Camera& camera, const RenderParams& params,
                                   double voxel_pixels);

/// How many levels tileLevels() needs: all that a camera sees of what lies at most `farthest` away
/// from it, from a finest voxel on.
int levelsNeeded(double finest_voxel, double farthest, const Camera& camera,
                 const RenderParams& params, double voxel_pixels);

/// The levels that a camera needs, finest first; their ranges meet. `finest` alone, if params.lod
/// is false or the volume is empty.
std::vector<VoxelLevel> voxelLevels(std::shared_ptr<const VoxelTree> finest, const Camera& camera,
                                    const RenderParams& params);

} // namespace volcomp
