// SPDX-License-Identifier: Apache-2.0
// A leaf of a VoxelTree, and how the voxels of a block are written into one.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include <openvdb/math/Coord.h>

#include "volcomp/base/error.h"
#include "volcomp/base/node_index.h"
#include "volcomp/render/tree/voxel_record.h"
#include "volcomp/volume/block_source.h"
#include "volcomp/volume/coarser_voxel.h"

namespace volcomp {

/// 8^3 voxels: which hold particles, and where their records begin.
struct TreeLeaf {
    VoxelMask mask{};                      ///< voxels of density > 0
    std::array<std::uint16_t, 8> before{}; ///< voxels in the words before
    std::uint32_t first = 0;               ///< record of the first voxel
    float colour_scale = 1;                ///< brightest component of its colours
    bool uniform = false;                  ///< all voxels have the first record
    bool directed = false; ///< some voxel's extinction depends on the ray's direction

    bool holds(int voxel) const { return mask[voxel >> 6] >> (voxel & 63) & 1; }
    /// The number of a voxel's record; the voxel must have density > 0.
    std::uint32_t recordIndex(int voxel) const
    {
        if (uniform) return first;
        const int word = voxel >> 6;
        const std::uint64_t lower = mask[word] & ((std::uint64_t(1) << (voxel & 63)) - 1);
        return first + before[word] + std::uint32_t(__builtin_popcountll(lower));
    }
    /// Sets `before` from the mask.
    void countBefore()
    {
        for (int w = 1; w < 8; ++w)
            before[w] = std::uint16_t(before[w - 1] + __builtin_popcountll(mask[w - 1]));
    }
    /// Voxels of the mask; countBefore() comes first.
    int count() const { return before[7] + __builtin_popcountll(mask[7]); }
};

/// Calls f(voxel, k) for the voxels of a mask in order; k counts them.
template <class F>
void forEachVoxelOf(const VoxelMask& mask, F&& f)
{
    std::size_t k = 0;
    for (int word = 0; word < 8; ++word)
        for (std::uint64_t left = mask[word]; left; left &= left - 1)
            f(word << 6 | __builtin_ctzll(left), k++);
}

/// The densities of all parts together in a leaf's 512 voxels, 1 / world length. Only those above 0
/// are kept, so a leaf far away, where a few voxels hold something, takes little memory.
class LeafDensities {
public:
    /// `of_records` holds those of all records of a tree.
    LeafDensities(const TreeLeaf& leaf, const float* of_records)
        : m_leaf(leaf), m_of_records(of_records)
    {
    }
    float operator[](int voxel) const
    {
        return m_leaf.holds(voxel) ? m_of_records[m_leaf.recordIndex(voxel)] : 0;
    }
    void copyTo(float* to) const ///< all 512
    {
        std::fill_n(to, kLeafSize, 0.0f);
        forEachVoxelOf(m_leaf.mask, [&](int voxel, std::size_t k) {
            to[voxel] = m_of_records[m_leaf.first + (m_leaf.uniform ? 0 : k)];
        });
    }

private:
    const TreeLeaf& m_leaf;
    const float* m_of_records;
};

/// Where the leaves of a tree are read.
struct LeafTables {
    const TreeLeaf* leaves = nullptr;
    const float* density = nullptr; ///< by record
    const VoxelRecord* records = nullptr;
    const ListedRecord* listed = nullptr;
    const ScatterRatio* scatter_ratio = nullptr; ///< by record; null: 1 everywhere
};

/// The tables of one leaf while it is written; those of records begin with the tree's first.
struct LeafToFill {
    TreeLeaf& leaf;
    float* density;
    VoxelRecord* records;
    ListedRecord* listed;
    ScatterRatio* scatter_ratio; ///< 1 everywhere at first; null if no part has any
};

/// Writes the particles of blocks of one volume into leaves. Threads share it.
class LeafFiller {
public:
    /// Parts in each voxel.
    using Counts = std::array<std::uint16_t, kLeafSize>;
    /// Density of all parts in each voxel.
    using Sums = std::array<float, kLeafSize>;

    /// `parts` must outlive this.
    explicit LeafFiller(const std::vector<PartInfo>& parts) : m_parts(parts) { }

    /// Sums the parts' densities up, and sets all of a leaf but `first`; `leaf.uniform` is set.
    /// Returns how many parts are in each voxel. Throws Error if a density, or their sum in a
    /// voxel, is negative or not finite; `origin` is the leaf's, for the message.
    Counts sumDensities(const BlockVoxels& voxels, const openvdb::Coord& origin, TreeLeaf& leaf,
                        Sums& sums) const;
    /// How many entries of lists such a leaf needs.
    std::uint32_t listEntries(const TreeLeaf& leaf, const Counts& count) const;
    /// Writes densities and records; `leaf.first` is set, and entries of lists begin at
    /// `first_entry`.
    void writeRecords(const BlockVoxels& voxels, const Counts& count, const Sums& sums,
                      const LeafToFill& to, std::uint32_t first_entry) const;

private:
    // A volume of more parts than a record can name keeps all of its voxels in lists.
    bool needsList(int parts_here) const
    {
        return parts_here > 1 || (m_parts.size() > VoxelRecord::kMostParts && parts_here > 0);
    }

    const std::vector<PartInfo>& m_parts;
};

/// "grid 'density', voxel (1, 2, 3): expected a finite density >= 0, found nan".
Error badDensity(const PartInfo& part, const openvdb::Coord& leaf, int voxel, float density);

} // namespace volcomp
