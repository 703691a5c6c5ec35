// SPDX-License-Identifier: Apache-2.0
// A VoxelTree from a file, and to one.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "volcomp/base/progress.h"
#include "volcomp/render/tree/voxel_tree.h"
#include "volcomp/volume/packed_volume.h"

namespace volcomp {

/// Reads a volume file, or another `grid` of it, into a tree, block by block: the peak of memory is
/// the tree and the topology of the file's grids. The caller has called openvdb::initialize().
/// Throws Error as readVolume() and as the tree's constructor do.
VoxelTree readVoxelTree(const std::filesystem::path& file, const Progress& progress = {},
                        const std::string& grid = {});

/// The tree's voxels as they are written to a file: directions, colours and scatter ratios to the
/// precision of half floats. A tile becomes 512 voxels in each of its places. The tree's axes must
/// be those of the world.
/// Only voxels that are `wanted` are taken, if that is given; of a tree of tiles those that are
/// there.
PackedVolume packedVolume(const VoxelTree& tree,
                          const std::function<bool(const openvdb::Coord& voxel)>& wanted = {});

} // namespace volcomp
