// SPDX-License-Identifier: Apache-2.0
// The leaves of a tree that a TileMaker makes when rays ask for them.
//
// A node of 128^3 voxels gets its table when it is first asked for: a word for each leaf, which is
// its number, kEmpty, or not yet known. Who first asks for a leaf that is not known makes its tile
// of 16^3 voxels; others who ask meanwhile wait for it. Making a tile waits for nothing, so nobody
// waits in a circle. A word that is known is read as any other number, so rays through what is
// there cost no more than through a tree that is complete.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <vector>

#include "volcomp/base/node_index.h"
#include "volcomp/base/reserved_array.h"
#include "volcomp/render/tree/node_table.h"
#include "volcomp/render/tree/tree_leaf.h"
#include "volcomp/volume/tile_maker.h"

namespace volcomp {

class TileStore;

/// Memory that the tiles of several trees may take together.
class TileBudget {
public:
    explicit TileBudget(std::size_t most) : m_most(most) { }

    std::size_t most() const { return m_most; } ///< bytes
    std::size_t used() const { return m_used; }
    std::size_t peak() const { return m_peak; }
    std::size_t drops() const { return m_drops; } ///< how often relieve() let go of all tiles
    /// Whether it is time to let go of tiles: so much is left as a few rays may need.
    bool isFull() const { return isFull(0.5); }
    /// If more than a share of it is used, lets go of all tiles, which are made anew when they are
    /// asked for. Nobody may use the trees meanwhile, and numbers of leaves mean nothing
    /// afterwards.
    void relieve(double share = 0.5);

private:
    friend class TileStore;
    bool isFull(double share) const { return double(m_used) > share * double(m_most); }
    void take(std::size_t bytes);

    const std::size_t m_most;
    std::atomic<std::size_t> m_used{0}, m_peak{0};
    std::size_t m_drops = 0;
    std::mutex m_mutex; ///< of what follows
    std::vector<TileStore*> m_stores;
};

/// Threads share it: its functions may be called at any time, but where they say otherwise.
class TileStore {
public:
    static constexpr int kEmpty = NodeTable::kEmpty;

    TileStore(std::shared_ptr<const TileMaker> maker, std::shared_ptr<TileBudget> budget);
    ~TileStore();
    TileStore(const TileStore&) = delete;
    TileStore& operator=(const TileStore&) = delete;

    /// The table of the node that holds voxel (x, y, z), or kEmpty if nothing can be in it.
    int node(int x, int y, int z) const
    {
        const Slots& slots = *m_slots.load(std::memory_order_acquire);
        const std::uint64_t key = NodeTable::keyOf(x, y, z);
        for (std::size_t i = NodeTable::hash(key);; ++i) {
            const Slot& slot = slots.slots[i & slots.mask];
            const int state = slot.state.load(std::memory_order_acquire);
            if (state == kFree) return addNode(x, y, z);
            if (slot.key == key) return state - kFirst;
        }
    }
    /// The leaf that holds voxel (x, y, z) in the table of its node, or kEmpty. Makes its tile if
    /// it is not there. Throws Error if the budget is spent, and what the maker throws.
    int leafIn(int table, int x, int y, int z) const
    {
        const int leaf = word(table, numberInNode(x, y, z)).load(std::memory_order_acquire);
        return leaf >= kEmpty ? leaf : makeTile(table, x, y, z);
    }

    /// Calls f(origin, leaf) for each place of 8^3 voxels that has a leaf, in the order of their
    /// nodes. Not while leaves are made.
    template <class F>
    void forEachPlace(F&& f) const
    {
        for (const Place& place : sortedPlaces())
            for (int n = 0; n < kNodeSize; ++n)
                if (const int l = word(place.table, n).load(std::memory_order_acquire); l > kEmpty)
                    f(place.origin + leafInNode(n), l);
    }
    /// Calls f(leaf, number of the leaf in its node) for the leaves of a node's table that are
    /// there. Not while leaves are made.
    template <class F>
    void forEachLeafOf(int table, F&& f) const
    {
        for (int n = 0; n < kNodeSize; ++n)
            if (const int l = word(table, n).load(std::memory_order_acquire); l > kEmpty) f(l, n);
    }
    /// Calls f(origin, place) for each place of 8^3 voxels of the nodes that were asked for, with
    /// the number that VoxelTree::place() gives it, in the order of their nodes.
    template <class F>
    void forEachKnownPlace(F&& f) const
    {
        for (const Place& place : sortedPlaces())
            for (int n = 0; n < kNodeSize; ++n)
                f(place.origin + leafInNode(n),
                  std::size_t(place.table) * kNodeSize + std::size_t(n));
    }
    /// One above the greatest number of a place.
    std::size_t placeCount() const { return m_words.size(); }
    /// Makes the tiles that reach into a box of voxels, on all threads; of these only those that
    /// are `wanted`, by their lowest voxel, if that is given.
    void make(const openvdb::CoordBBox& box,
              const std::function<bool(const openvdb::Coord& tile)>& wanted = {}) const;

    const TileMaker& maker() const { return *m_maker; }
    TileBudget& budget() const { return *m_budget; }
    LeafTables tables() const;
    std::size_t leafCount() const { return m_leaves.size(); }
    std::uint64_t voxelCount() const { return m_voxels; }
    std::size_t tileCount() const { return m_tiles; } ///< how many were made, again ones too
    std::size_t memoryBytes() const;

private:
    // States of a node's slot; kFirst + number of its table.
    static constexpr int kFree = 0, kFirst = 2;
    // Words of leaves that are not known: nobody makes them yet; somebody does.
    static constexpr int kUnknown = -2, kInWork = -3;
    struct Slot {
        std::atomic<int> state{kFree};
        std::uint64_t key = 0; // written before the state
    };
    struct Slots {
        explicit Slots(std::size_t size) : slots(size), mask(size - 1) { }
        std::vector<Slot> slots; // a power of two, at most half of them in use
        std::size_t mask;
    };
    struct Place {
        openvdb::Coord origin;
        int table;
    };

    std::atomic<int>& word(int table, int leaf) const
    {
        return m_words.data()[std::size_t(table) * kNodeSize + std::size_t(leaf)];
    }
    std::vector<Place> sortedPlaces() const;
    int addNode(int x, int y, int z) const;
    static void insert(Slots& slots, std::uint64_t key, int state);
    int addTable(const openvdb::Coord& origin) const;
    int makeTile(int table, int x, int y, int z) const;
    void fillTile(const openvdb::Coord& tile, int (&made)[8]) const;
    int fillLeaf(const BlockVoxels& voxels, const openvdb::Coord& origin) const;
    void take(std::size_t bytes) const;
    friend class TileBudget;
    void drop();

    const std::shared_ptr<const TileMaker> m_maker;
    const std::shared_ptr<TileBudget> m_budget;
    const LeafFiller m_filler;
    const bool m_has_ratios;
    mutable std::mutex m_mutex;                              // of what follows, while it changes
    mutable std::vector<std::unique_ptr<Slots>> m_all_slots; // the last is in use
    mutable std::atomic<Slots*> m_slots{nullptr};
    mutable std::size_t m_nodes = 0;
    mutable std::vector<Place> m_places; // nodes with a table
    mutable ReservedArray<std::atomic<int>> m_words;
    mutable ReservedArray<TreeLeaf> m_leaves;
    mutable ReservedArray<VoxelRecord> m_records;
    mutable ReservedArray<float> m_density; // by record
    mutable ReservedArray<ListedRecord> m_listed;
    mutable ReservedArray<ScatterRatio> m_scatter_ratio; // by record
    mutable std::atomic<std::uint64_t> m_voxels{0};
    mutable std::atomic<std::size_t> m_tiles{0};
    mutable std::atomic<std::size_t> m_taken{0}, m_taken_by_words{0}; // of the budget
};

} // namespace volcomp
