// The coarser levels of a volume that a camera needs (MODEL section 8), made anew or read from
// files beside it.
//
// Making levels reads every voxel; a camera far away looks at few. So levels can be written once,
// VOLUME.level1.vdb with voxels of twice the width, VOLUME.level2.vdb of four times and so on, down
// to eight voxels. They are volumes as any other. Their metadata tell which file they were made
// from:
//
//     volcomp_levels_of                         volumeIdentifier() of that file
//     volcomp_tau                               the opacity for which they keep the mean
//     transmittance volcomp_levels_voxel                      width of its voxels, world units
//     volcomp_levels_low, volcomp_levels_high   corners of its leaves, world space
//     volcomp_levels_last                       whether this is the coarsest level
#pragma once

#include <filesystem>
#include <limits>
#include <memory>
#include <vector>

#include "volcomp/view/camera.h"
#include "volcomp/base/progress.h"
#include "volcomp/render/render_params.h"
#include "volcomp/render/tree/voxel_tree.h"

namespace volcomp {

/// Voxels for a range of distances.
struct VoxelLevel {
    std::shared_ptr<const VoxelTree> tree;
    double start = 0,
           end = std::numeric_limits<double>::infinity(); ///< from the camera, world units
};

/// The levels that a camera needs, finest first; their ranges meet. Without params.lod `finest`
/// alone, as where the volume is empty.
std::vector<VoxelLevel> voxelLevels(std::shared_ptr<const VoxelTree> finest, const Camera& camera,
                                    const RenderParams& params);

/// The same for a volume file. Reads no more than these levels where all are stored, else the
/// volume, and makes them. Throws Error as readVolume().
std::vector<VoxelLevel> readVoxelLevels(const std::filesystem::path& volume, const Camera& camera,
                                        const RenderParams& params, const Progress& progress = {});

/// How many levels are stored beside a volume for this file as it is and this opacity; 0 where any
/// is missing or damaged. Throws Error as readVolume().
int storedLevels(const std::filesystem::path& volume, double tau);

/// Where level n >= 1 is stored.
std::filesystem::path levelFile(const std::filesystem::path& volume, int n);

/// Makes and writes all levels of a volume file. Values are half floats where their range allows
/// it, as in any volume. Throws Error as readVolume(), and where a file cannot be written or a
/// level has more than 2^28 voxels in active tiles, which files of levels do not have.
void writeVoxelLevels(const std::filesystem::path& volume, double tau,
                      const Progress& progress = {});

} // namespace volcomp
