// SPDX-License-Identifier: Apache-2.0
// Sums density, directions, colour, scatter ratios and squares of strands' densities over 16^3
// voxels: the working memory of compose(), one for each thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "volcomp/compose/tile_kernels.h"
#include "volcomp/compose/voxel_sum.h"
#include "volcomp/volume/packed_volume.h"

namespace volcomp {

/// Which values voxels have beside their density.
struct VoxelValues {
    bool direction = false, colour = false, scatter_ratio = false, own_share = false;
};

/// The sums of one tile at a time; finish() makes it ready for the next.
class TileAccumulator {
public:
    /// Voxels along an edge. With 32 the cells (3 MB) leave the second cache, and adding took 1.8
    /// times as long.
    static constexpr int kLog2 = TileCells::kLog2, kSize = TileCells::kSize;

    TileAccumulator();
    ~TileAccumulator();

    /// What the next add() adds. Sums that were never written are zero.
    CubeBatch& batch() { return *m_batch; }

    /// Adds the cubes [low, low + width]^3 of the first `count` of the batch to the tile's voxels,
    /// each times its overlap with the voxel. Every cube must reach into the tile; what it has
    /// outside belongs to the neighbours and is left out. 0 < width <= 2.
    void add(int count, float width);

    /// Whether a cube reaches into the tile along one axis.
    static bool reaches(float low, float width) { return low + width > 0 && low < kSize; }

    /// Appends blocks of all voxels whose density is above `minimum` (and above 0), with the values
    /// that are asked for, and clears the sums. `origin`: the tile's first voxel.
    void finish(const openvdb::Coord& origin, float minimum, const VoxelValues& values,
                VoxelStore& store, std::vector<PackedBlock>& blocks);

private:
    struct Channels;

    TileCells cells() { return {m_sums.get(), m_touched}; }
    int findVoxels(const openvdb::Coord& origin, float minimum);
    void findInBlock(const std::uint64_t (&touched)[8], int first, float minimum,
                     const openvdb::Coord& origin, int& count);
    void findDirections(int count);
    void writeBlocks(int count, const VoxelValues& values, VoxelStore& store);

    struct Free {
        void operator()(void* p) const;
    };
    std::unique_ptr<VoxelSum[], Free> m_sums;                             ///< TileCells::sums
    std::int32_t m_touched[TileCells::kAcross * TileCells::kAcross] = {}; ///< TileCells::touched
    std::unique_ptr<CubeBatch> m_batch;
    std::unique_ptr<Channels> m_channels;
};

} // namespace volcomp
