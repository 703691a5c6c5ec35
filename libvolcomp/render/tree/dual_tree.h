// SPDX-License-Identifier: Apache-2.0
// The volume for the trilinear filter: cells between eight voxel centres, in leaves of 8^3 cells.
//
// Coordinates are VoxelTree's corner coordinates less half a voxel: cell (i,j,k) is [i,i+1)^3 and
// its corners are the centres of the voxels (i,j,k) to (i+1,j+1,k+1). The class offers what
// forEachLeaf() and MarchRay ask of a tree. It holds places only: each thread gathers the 9^3
// densities that the cells of a leaf need when its rays come by, and forgets them again.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include <tbb/enumerable_thread_specific.h>

#include "volcomp/render/tree/voxel_tree.h"

namespace volcomp {

/// The tree of the cells between voxel centres; rays go through it as through a VoxelTree. It can
/// be neither copied nor moved, as the threads' densities refer to it.
class DualTree {
public:
    static constexpr int kDim = kLeafDim + 1;          ///< densities along an edge of a leaf
    static constexpr int kValues = kDim * kDim * kDim; ///< densities in a leaf

    /// `tree` must outlive this.
    explicit DualTree(const VoxelTree& tree);
    DualTree(const DualTree&) = delete;
    DualTree& operator=(const DualTree&) = delete;

    bool empty() const { return m_leaves.empty(); }
    const openvdb::CoordBBox& bounds() const { return m_bounds; } ///< cells, inclusive
    /// As VoxelTree::node() and leafIn(), for cells.
    int node(int x, int y, int z) const { return m_places.node(x, y, z); }
    int leafIn(int node, int x, int y, int z) const { return m_places.leafIn(node, x, y, z); }

    /// A voxel of the tree. Its density is 0 if leaf is VoxelTree::kEmpty.
    struct Corner {
        int leaf, voxel;
    };
    /// Corner (x,y,z), which has the number 4 x + 2 y + z, of a cell of a leaf; `cell` is its
    /// VoxelTree::offset().
    Corner corner(int leaf, int cell, int number) const
    {
        const int x = (cell >> 6) + (number >> 2), y = (cell >> 3 & 7) + (number >> 1 & 1),
                  z = (cell & 7) + (number & 1);
        return {m_leaves[leaf][(x >> 3) << 2 | (y >> 3) << 1 | z >> 3], VoxelTree::offset(x, y, z)};
    }

    /// The densities of the leaves that a thread met last.
    class Gathered {
    public:
        explicit Gathered(const DualTree& dual) : m_dual(dual) { }
        /// kDim^3 densities at the corners of a leaf's cells, z fastest; good until the next call.
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
        // 12 MB for each thread; a tile's rays of the finest voxels meet about 1,000 leaves.
        static constexpr int kBits = 12, kStride = 736;
        void allocate();

        const DualTree& m_dual;
        std::vector<int> m_at; ///< the leaf at each place
        std::unique_ptr<float[]> m_values;
    };
    Gathered& gathered() const { return m_gathered.local(); } ///< those of the calling thread

private:
    void gather(int leaf, float* values) const;

    const VoxelTree& m_tree;
    openvdb::CoordBBox m_bounds;
    NodeTable m_places;
    /// Leaves of the voxel tree that hold the corners of a leaf's cells, 4 x + 2 y + z.
    std::vector<std::array<std::int32_t, 8>> m_leaves;
    mutable tbb::enumerable_thread_specific<Gathered> m_gathered;
};

} // namespace volcomp
