// SPDX-License-Identifier: Apache-2.0
// Where the leaves of a tree are: a hash table of nodes of 128^3 voxels, each with the numbers of
// its 16^3 leaves.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <openvdb/math/Coord.h>

#include "volcomp/volume/block_source.h"

namespace volcomp {

/// Numbers of leaves by place. Coordinates are of voxels, within +-2^27.
class NodeTable {
public:
    static constexpr int kEmpty = -1;

    /// Room for so many nodes; more may come.
    explicit NodeTable(std::size_t nodes = 0);

    /// A new table of leaves, all of them `leaf`. Returns its number.
    int addTable(int leaf = kEmpty);
    /// Lets the node at `origin`, which must not be there yet, have a table. Nodes may share one.
    void insert(const openvdb::Coord& origin, int table);
    /// Sets the leaf at a place. Adds the node with a table of its own, if it is not there.
    void setLeaf(const openvdb::Coord& place, int leaf);
    std::int32_t* leaves(int table) { return &m_leaves[std::size_t(table) * kNodeSize]; }

    /// The table of the node that holds voxel (x,y,z), or kEmpty.
    int node(int x, int y, int z) const
    {
        const std::uint64_t key = keyOf(x, y, z);
        for (std::size_t i = hash(key);; ++i) {
            const Slot& slot = m_slots[i & m_mask];
            if (slot.table == kEmpty || slot.key == key) return slot.table;
        }
    }
    /// The leaf that holds voxel (x,y,z) in the table of its node, or kEmpty.
    int leafIn(int table, int x, int y, int z) const
    {
        return m_leaves[std::size_t(table) * kNodeSize + numberInNode(x, y, z)];
    }
    int leafAt(int x, int y, int z) const
    {
        const int table = node(x, y, z);
        return table == kEmpty ? kEmpty : leafIn(table, x, y, z);
    }

    /// Calls f(origin, leaf) for each place of 8^3 voxels that has a leaf, in an order that follows
    /// from what was inserted.
    template <class F>
    void forEachPlace(F&& f) const
    {
        for (const Slot& slot : m_slots) {
            if (slot.table == kEmpty) continue;
            const openvdb::Coord origin = originOf(slot.key);
            for (int n = 0; n < kNodeSize; ++n)
                if (const int l = m_leaves[std::size_t(slot.table) * kNodeSize + n]; l != kEmpty)
                    f(origin + leafInNode(n), l);
        }
    }

    /// A number for the node that holds voxel (x,y,z): 21 bits with sign of each coordinate,
    /// counted in nodes.
    static std::uint64_t keyOf(int x, int y, int z)
    {
        return (std::uint64_t(x >> 7) & 0x1fffff) << 42 | (std::uint64_t(y >> 7) & 0x1fffff) << 21
            | (std::uint64_t(z >> 7) & 0x1fffff);
    }
    /// Where the search for a node begins in a table of slots; its lower bits count.
    static std::size_t hash(std::uint64_t key)
    {
        return std::size_t((key ^ key >> 29) * 0x9e3779b97f4a7c15ULL >> 32);
    }

    std::size_t memoryBytes() const
    {
        return m_slots.size() * sizeof(Slot) + m_leaves.size() * sizeof(std::int32_t);
    }

private:
    struct Slot {
        std::uint64_t key = 0;
        int table = kEmpty;
    };
    static openvdb::Coord originOf(std::uint64_t key);
    void insertKey(std::uint64_t key, int table);

    std::vector<Slot> m_slots; ///< a power of two, at most half of them in use
    std::size_t m_mask = 0, m_nodes = 0;
    std::vector<std::int32_t> m_leaves; ///< kNodeSize a table
};

} // namespace volcomp
