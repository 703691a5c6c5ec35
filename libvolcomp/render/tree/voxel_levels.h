// SPDX-License-Identifier: Apache-2.0
// The coarser levels of a volume that a camera needs (MODEL section 8), made from the volume or
// read from files beside it.
//
// Making levels reads every voxel; a camera far away looks at few. So levels can be written once:
// VOLUME.level1.vdb with voxels of twice the width, VOLUME.level2.vdb of four times the width and
// so on, down to eight voxels. They are volumes as any other. Their metadata tell which file they
// were made from:
//
//     volcomp_levels_version                    2; files of another number are not read
//     volcomp_levels_of                         volumeIdentifier() of that file
//     volcomp_tau                               the extinction for density 1 and length 1 at which
//                                               they keep the mean transmittance
//     volcomp_levels_voxel                      width of its voxels, world units
//     volcomp_levels_low, volcomp_levels_high   corners of its leaves, world space
//     volcomp_levels_last                       whether this is the coarsest level
//
// Before a function that reads or writes is called, the program calls openvdb::initialize() once.
#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "volcomp/base/interval.h"
#include "volcomp/base/progress.h"
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

/// The same for a volume file. Reads only these levels, if all of the volume's are stored;
/// otherwise reads the volume and makes them. `grid` here and below names another grid of the file
/// as the density (readVolume()). Throws Error as readVolume().
std::vector<VoxelLevel> readVoxelLevels(const std::filesystem::path& volume, const Camera& camera,
                                        const RenderParams& params, const Progress& progress = {},
                                        const std::string& grid = {});

/// How many levels are stored beside a volume, for this file as it is and this tau; 0 if any is
/// missing, damaged or written by volcomp 0.1.0. Throws Error as readVolume().
int storedLevels(const std::filesystem::path& volume, double tau, const std::string& grid = {});

/// The file of level n >= 1.
std::filesystem::path levelFile(const std::filesystem::path& volume, int n);

/// Makes and writes all levels of a volume file. Values are half floats if their range allows it,
/// as in any volume. Throws Error as readVolume() and writeVolume() do, and if a level has 2^28
/// voxels or more, as tiles become voxels in these files.
void writeVoxelLevels(const std::filesystem::path& volume, double tau,
                      const Progress& progress = {}, const std::string& grid = {});

} // namespace volcomp
