// Sums density, directions and colour over 32^3 voxels: the working memory of compose(), one for each thread.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <openvdb/openvdb.h>

namespace volcomp {

/// What is added to a voxel. `tensor` is the sum of w t tᵀ, its trace the density; `colour` is times density. Twelve floats, so that three
/// SSE registers hold it.
struct alignas(16) VoxelSum {
    float density = 0;
    float tensor[6] = {0, 0, 0, 0, 0, 0}; ///< xx, yy, zz, xy, xz, yz
    float colour[3] = {0, 0, 0};
    float unused[2] = {0, 0};
};

class TileAccumulator {
public:
    static constexpr int kLog2 = 5, kSize = 1 << kLog2;                 ///< voxels along an edge
    static constexpr int kBlocks = (kSize / 8) * (kSize / 8) * (kSize / 8);

    TileAccumulator();

    /// Adds `what` to the cells that the cube [low, low + width]³ overlaps, times the overlap's volume in cells. Coordinates are the tile's: cell i is
    /// [i, i+1). Parts outside of the tile are left out: they belong to the neighbour. 0 < width <= 2.
    void add(const float low[3], float width, const VoxelSum& what);

    /// What finish() makes of 8^3 voxels; null where the caller asked for no such grid.
    struct Leaves {
        openvdb::FloatTree::LeafNodeType* density = nullptr;
        openvdb::Vec3STree::LeafNodeType* direction = nullptr;
        openvdb::Vec3STree::LeafNodeType* colour = nullptr;
    };
    /// Makes leaves of all voxels whose density is above `minimum` (and above 0), and clears the sums. `origin`: the tile's first voxel.
    /// The leaves belong to the caller.
    std::vector<Leaves> finish(const openvdb::Coord& origin, float minimum, bool direction, bool colour);

private:
    Leaves finishBlock(VoxelSum* sums, const openvdb::Coord& origin, float minimum, bool direction, bool colour);

    struct Free {
        void operator()(VoxelSum* p) const { ::operator delete[](p, std::align_val_t(64)); }
    };
    std::unique_ptr<VoxelSum[], Free> m_sums; ///< block after block, in each the order of an OpenVDB leaf
    bool m_touched[kBlocks] = {};
    std::int32_t m_x[kSize], m_y[kSize], m_z[kSize]; ///< a cell's place is the sum of its coordinates' offsets
};

} // namespace volcomp
