// SPDX-License-Identifier: Apache-2.0
// The levels that a camera looks at as volumes for other programs: fine voxels near it, coarse ones
// far away.
#pragma once

#include <cstddef>
#include <vector>

#include "volcomp/base/vec.h"
#include "volcomp/render/tree/voxel_levels.h"
#include "volcomp/volume/packed_volume.h"

namespace volcomp {

/// The voxels of levels[n], as packedVolume() takes them, where the level is looked at from `eye`
/// (world). The volumes of all levels together hold everything once: a voxel is taken whose middle
/// is as far from the eye as its level begins, unless the coarser voxel that stands for it is far
/// enough for its own level. Where two levels meet, voxels overlap, or miss each other, by half a
/// finer voxel at most, as voxel (0, 0, 0) of every level has its middle at the origin.
///
/// The trees are those of tileLevels(), each twice as wide as the one before; what is taken of them
/// is made, and counts in their budget. Throws what making tiles throws.
PackedVolume viewVolume(const std::vector<VoxelLevel>& levels, std::size_t n, const Vec3d& eye);

} // namespace volcomp
