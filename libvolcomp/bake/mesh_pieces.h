// SPDX-License-Identifier: Apache-2.0
// The triangles of a part of a MeshModel, cut into small pieces and counted by voxel. Private to
// baking.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <openvdb/openvdb.h>

#include "volcomp/bake/mesh_model.h"

namespace volcomp {

/// What one sheet has in one voxel.
struct SheetInVoxel {
    std::uint64_t voxel; ///< packedVoxel()
    std::uint32_t sheet;
    std::uint32_t order;           ///< of the chunk that found it
    float area = 0;                ///< of what is there, in squares of a voxel's side
    std::array<float, 3> colour{}; ///< linear RGB times area
    std::array<float, 6> tensor{}; ///< sum of area n nT: xx, yy, zz, xy, xz, yz

    void add(const SheetInVoxel& o);
};

/// Voxels have coordinates between plus and minus half of this.
constexpr int kMostVoxelsAcross = 1 << 20;

/// Coordinates as a key, sorted by leaf (8^3 voxels), then as OpenVDB counts in a leaf.
std::uint64_t packedVoxel(const openvdb::Coord& at);
openvdb::Coord unpackedVoxel(std::uint64_t key);

/// One entry for each sheet and voxel that share something, sorted by voxel, then by sheet.
/// Triangles are cut by halves until no side is longer than a quarter of a voxel; a piece counts
/// where its middle is. Areas are so exact in sum. The same for any number of threads. Throws Error
/// if the voxels are too many or too far out.
std::vector<SheetInVoxel> cutIntoVoxels(const MeshModel& model, const MeshModelPart& part,
                                        double voxel);

} // namespace volcomp
