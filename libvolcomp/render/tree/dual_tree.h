// The volume for the trilinear filter: cells between eight voxel centres, in blocks of 8^3 cells.
//
// Coordinates are VoxelTree's corner coordinates less half a voxel: cell (i,j,k) is [i,i+1)^3 and
// its corners are the centres of the voxels (i,j,k) to (i+1,j+1,k+1). The class offers what
// forEachLeaf() and MarchRay ask of a tree. It holds places only; the 9^3 densities that a block's
// cells need are gathered by each thread where its rays come by, and forgotten again.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

#include <tbb/enumerable_thread_specific.h>

#include "volcomp/render/tree/voxel_tree.h"

namespace volcomp {

/// The tree of the cells between voxel centres; walked as a VoxelTree is.
class DualTree {
public:
    static constexpr int kDim = kLeafDim + 1,
                         kValues =
                             kDim * kDim * kDim; ///< densities along an edge of a block, and in it

    /// `tree` must outlive this.
    explicit DualTree(const VoxelTree& tree);

    bool empty() const { return m_leaves.empty(); }
    const openvdb::CoordBBox& bounds() const { return m_bounds; }
    int block(int x, int y, int z) const
    {
        const auto at = m_blocks.find(openvdb::Coord(x >> 7, y >> 7, z >> 7));
        return at == m_blocks.end() ? VoxelTree::kEmpty : at->second;
    }
    int leafIn(int block, int x, int y, int z) const
    {
        return m_children[std::size_t(block) * 4096
                          + ((x >> 3 & 15) << 8 | (y >> 3 & 15) << 4 | (z >> 3 & 15))];
    }

    struct Corner { ///< a voxel of the tree; density > 0 only where leaf != VoxelTree::kEmpty
        int leaf, voxel;
    };
    /// Corner (x,y,z), number 4 x + 2 y + z, of a cell; its offset is as VoxelTree::offset().
    Corner corner(int leaf, int cell, int number) const
    {
        const int x = (cell >> 6) + (number >> 2), y = (cell >> 3 & 7) + (number >> 1 & 1),
                  z = (cell & 7) + (number & 1);
        return {m_leaves[leaf][(x >> 3) << 2 | (y >> 3) << 1 | z >> 3], VoxelTree::offset(x, y, z)};
    }

    /// Gathered densities of the blocks that a thread met last.
    class Gathered {
    public:
        explicit Gathered(const DualTree& dual) : m_dual(dual) { }
        /// kDim^3, z fastest; good until the next call.
        const float* densities(int leaf)
        {
            const std::size_t place = (std::uint32_t(leaf) * 0x9e3779b1u) >> (32 - kBits);
            if (m_at.empty()) allocate();
            float* values = m_values.get() + place * kStride;
            if (m_at[place] != leaf) {
                m_dual.gather(leaf, values);
                m_at[place] = leaf;
            }
            return values;
        }

    private:
        static constexpr int kBits = 12, kStride = 736; // 12 MB a thread; a tile's rays of the
                                                        // finest voxels meet about 1,000 blocks
        void allocate();

        const DualTree& m_dual;
        std::vector<int> m_at;
        std::unique_ptr<float[]> m_values;
    };
    Gathered& gathered() const { return m_gathered.local(); } ///< this thread's

    std::size_t memoryBytes() const
    {
        return m_leaves.size() * sizeof(m_leaves[0]) + m_children.size() * sizeof(std::int32_t);
    }

private:
    void gather(int leaf, float* values) const;

    const VoxelTree& m_tree;
    openvdb::CoordBBox m_bounds;
    std::unordered_map<openvdb::Coord, int> m_blocks;
    std::vector<std::int32_t> m_children;
    std::vector<std::array<std::int32_t, 8>>
        m_leaves; ///< of the tree, whose voxels a block's cells lie between
    mutable tbb::enumerable_thread_specific<Gathered> m_gathered;
};

} // namespace volcomp
