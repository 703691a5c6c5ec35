// Sums density, directions and colour over 16^3 voxels: the working memory of compose(), one for
// each thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "volcomp/volume/packed_volume.h"

namespace volcomp {

/// What is added to a voxel, and what a voxel has: a cache line.
struct alignas(64) VoxelSum {
    float diagonal[3] = {0, 0,
                         0}; ///< xx, yy, zz of the sum of w t tᵀ; the trace is about the density
    float unused = 0;
    float mixed[3] = {0, 0, 0}; ///< xy, yz, zx
    float unused_too = 0;
    float colour[3] = {0, 0, 0}; ///< times density
    float density = 0;
    float unused_either[4] = {0, 0, 0, 0};
};
static_assert(sizeof(VoxelSum) == 64);

/// The sums of one tile at a time; used again for the next.
class TileAccumulator {
public:
    static constexpr int kLog2 = 4,
                         kSize = 1 << kLog2; ///< voxels along an edge; with 5 the cells (3 MB)
                                             ///< leave the second cache: adding took 1.8 x as long
    static constexpr int kBatch = 64;        ///< voxels that are added at a time, at most

    TileAccumulator();
    ~TileAccumulator();

    /// Cubes to add. Coordinates are the tile's: cell i is [i, i+1).
    struct Batch {
        alignas(64) float low[3][kBatch]; ///< lowest corner, x y z
        VoxelSum sum[kBatch];
    };

    /// What the next add() adds.
    Batch& batch() { return *m_batch; }

    /// Adds the cubes [low, low + width]³ of the first `count` of the batch, each times its overlap
    /// with a cell in cells. Every cube must reach into the tile; what it has outside belongs to
    /// the neighbour and is left out. 0 < width <= 2.
    void add(int count, float width);

    /// Whether a cube reaches into the tile along one axis.
    static bool reaches(float low, float width) { return low + width > 0 && low < kSize; }

    /// Appends blocks of all voxels whose density is above `minimum` (and above 0), with directions
    /// and colours if asked for, and clears the sums. `origin`: the tile's first voxel.
    void finish(const openvdb::Coord& origin, float minimum, bool direction, bool colour,
                VoxelStore& store, std::vector<PackedBlock>& blocks);

private:
    /// Cells of a cube that starts in the tile or reaches into it may lie this far outside; they
    /// are summed and never looked at.
    static constexpr int kMargin = 2, kAcross = kSize + 2 * kMargin,
                         kCells = kAcross * kAcross * kAcross;

    struct Shares;
    struct Channels;
    static void findShares(const Batch& batch, int count, float width, Shares& s);
    void addWide(const VoxelSum& sum, const Shares& s, int k);
    int findVoxels(const openvdb::Coord& origin, float minimum);
    void gather(int count);

    struct Free {
        void operator()(void* p) const;
    };
    std::unique_ptr<VoxelSum[], Free> m_cells;      ///< z runs fastest
    std::int32_t m_touched[kAcross * kAcross] = {}; ///< bit z of row (x, y)
    std::unique_ptr<Batch> m_batch;
    std::unique_ptr<Channels> m_channels;
};

} // namespace volcomp
