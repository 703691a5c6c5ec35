// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/tree/tile_store.h"

#include <algorithm>
#include <thread>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "volcomp/base/error.h"

namespace volcomp {
namespace {

constexpr std::size_t kFirstSlots = 1 << 12;

// Elements of a table of which there is room for if it takes the whole budget; numbers of leaves
// are ints, those of records 32 bits.
template <class T>
std::size_t roomFor(const TileBudget& budget, std::size_t most)
{
    return std::min(budget.most() / sizeof(T) + kNodeSize, most);
}

} // namespace

TileStore::TileStore(std::shared_ptr<const TileMaker> maker, std::shared_ptr<TileBudget> budget)
    : m_maker(std::move(maker)), m_budget(std::move(budget)), m_filler(m_maker->parts()),
      m_has_ratios(std::any_of(m_maker->parts().begin(), m_maker->parts().end(),
                               [](const PartInfo& part) { return part.has_scatter_ratio; })),
      m_words(roomFor<int>(*m_budget, std::size_t(1) << 40)),
      m_leaves(roomFor<TreeLeaf>(*m_budget, std::size_t(1) << 31)),
      m_records(roomFor<VoxelRecord>(*m_budget, std::size_t(1) << 32)),
      m_density(roomFor<VoxelRecord>(*m_budget, std::size_t(1) << 32)),
      m_listed(roomFor<ListedRecord>(*m_budget, std::size_t(1) << 32)),
      m_scatter_ratio(m_has_ratios ? roomFor<ScatterRatio>(*m_budget, std::size_t(1) << 32) : 0)
{
    m_slots = m_all_slots.emplace_back(std::make_unique<Slots>(kFirstSlots)).get();
    const std::lock_guard<std::mutex> lock(m_budget->m_mutex);
    m_budget->m_stores.push_back(this);
}

TileStore::~TileStore()
{
    m_budget->m_used -= m_taken;
    const std::lock_guard<std::mutex> lock(m_budget->m_mutex);
    auto& stores = m_budget->m_stores;
    stores.erase(std::find(stores.begin(), stores.end(), this));
}

LeafTables TileStore::tables() const
{
    return {m_leaves.data(), m_density.data(), m_records.data(), m_listed.data(),
            m_has_ratios ? m_scatter_ratio.data() : nullptr};
}

std::size_t TileStore::memoryBytes() const { return m_taken; }

void TileStore::take(std::size_t bytes) const
{
    m_taken += bytes;
    m_budget->take(bytes);
}

void TileBudget::take(std::size_t bytes)
{
    const std::size_t used = m_used.fetch_add(bytes) + bytes;
    std::size_t peak = m_peak;
    while (used > peak && !m_peak.compare_exchange_weak(peak, used)) { }
    if (used > m_most)
        throw Error(fmt::format("the voxels that a part of the picture needs at once take more "
                                "than the {:.3g} GB that there are for them: give --max-memory "
                                "more, or render larger voxels (compose.voxel_pixels)",
                                1e-9 * double(m_most)));
}

void TileBudget::relieve(double share)
{
    if (!isFull(share)) return;
    ++m_drops;
    for (TileStore* store : m_stores) store->drop();
}

// Lets go of all tiles. Those that turned out empty stay known as that, if all of their tile did.
void TileStore::drop()
{
    for (const Place& place : m_places)
        for (int t = 0; t < kTilesOfNode; ++t) {
            const openvdb::Coord tile((t >> 6) * kTileDim, (t >> 3 & 7) * kTileDim,
                                      (t & 7) * kTileDim);
            std::atomic<int>* words[8];
            bool any = false;
            for (int k = 0; k < 8; ++k) {
                words[k] =
                    &word(place.table,
                          numberInNode(tile.offsetBy(kLeafDim * (k >> 2), kLeafDim * (k >> 1 & 1),
                                                     kLeafDim * (k & 1))));
                any |= *words[k] > kEmpty;
            }
            for (int k = 0; any && k < 8; ++k) *words[k] = kUnknown;
        }
    m_leaves.clear();
    m_records.clear();
    m_density.clear();
    m_listed.clear();
    m_scatter_ratio.clear();
    m_voxels = 0;
    m_budget->m_used -= m_taken - m_taken_by_words;
    m_taken = m_taken_by_words.load();
}

// Finds the table of a node that no slot had a moment ago, or adds it.
int TileStore::addNode(int x, int y, int z) const
{
    const std::uint64_t key = NodeTable::keyOf(x, y, z);
    const std::lock_guard<std::mutex> lock(m_mutex);
    Slots* slots = m_all_slots.back().get();
    for (std::size_t i = NodeTable::hash(key);; ++i) {
        const Slot& slot = slots->slots[i & slots->mask];
        const int state = slot.state.load(std::memory_order_relaxed);
        if (state == kFree) break;
        if (slot.key == key) return state - kFirst;
    }
    const int table = addTable(openvdb::Coord(x, y, z) & ~(kNodeDim - 1));
    if (2 * ++m_nodes > slots->slots.size()) {
        // Those who read the old slots find fewer nodes there, and come here.
        auto more = std::make_unique<Slots>(2 * slots->slots.size());
        for (const Slot& slot : slots->slots)
            if (const int state = slot.state.load(std::memory_order_relaxed); state != kFree)
                insert(*more, slot.key, state);
        slots = m_all_slots.emplace_back(std::move(more)).get();
        insert(*slots, key, table + kFirst);
        m_slots.store(slots, std::memory_order_release);
    } else insert(*slots, key, table + kFirst);
    return table;
}

void TileStore::insert(Slots& slots, std::uint64_t key, int state)
{
    std::size_t i = NodeTable::hash(key);
    while (slots.slots[i & slots.mask].state.load(std::memory_order_relaxed) != kFree) ++i;
    Slot& slot = slots.slots[i & slots.mask];
    slot.key = key;
    slot.state.store(state, std::memory_order_release);
}

// Adds a table in which the leaves of tiles without particles are empty, and the others unknown.
// Returns its number, or kEmpty if all are empty.
int TileStore::addTable(const openvdb::Coord& origin) const
{
    const openvdb::CoordBBox all(origin, origin.offsetBy(kNodeDim - 1));
    if (!m_maker->bounds().hasOverlap(all)) return kEmpty;
    const std::bitset<kTilesOfNode> tiles = m_maker->tiles(origin);
    if (tiles.none()) return kEmpty;
    m_taken_by_words += kNodeSize * sizeof(int);
    take(kNodeSize * sizeof(int));
    const int table = int(m_words.append(kNodeSize) / kNodeSize);
    for (int n = 0; n < kNodeSize; ++n) {
        const openvdb::Coord leaf = leafInNode(n);
        word(table, n).store(tiles[tileInNode(leaf[0], leaf[1], leaf[2])] ? kUnknown : kEmpty,
                             std::memory_order_relaxed);
    }
    m_places.push_back({origin, table});
    return table;
}

// The leaf that holds a voxel, when its tile is made, by this thread or another.
int TileStore::makeTile(int table, int x, int y, int z) const
{
    const openvdb::Coord tile(x & ~(kTileDim - 1), y & ~(kTileDim - 1), z & ~(kTileDim - 1));
    // The tile's first leaf tells how far the tile is; it becomes known last.
    std::atomic<int>& first = word(table, numberInNode(tile));
    std::atomic<int>& asked = word(table, numberInNode(x, y, z));
    for (int tries = 0;; ++tries) {
        int state = kUnknown;
        if (first.compare_exchange_strong(state, kInWork, std::memory_order_acq_rel)) break;
        if (state != kInWork) return asked.load(std::memory_order_acquire);
        if (tries > 16) std::this_thread::yield();
    }
    int made[8];
    try {
        fillTile(tile, made);
    } catch (...) {
        first.store(kUnknown, std::memory_order_release);
        throw;
    }
    for (int k = 7; k >= 0; --k) {
        const openvdb::Coord leaf =
            tile.offsetBy(kLeafDim * (k >> 2), kLeafDim * (k >> 1 & 1), kLeafDim * (k & 1));
        word(table, numberInNode(leaf)).store(made[k], std::memory_order_release);
    }
    return asked.load(std::memory_order_acquire);
}

void TileStore::fillTile(const openvdb::Coord& tile, int (&made)[8]) const
{
    // Not in TBB's storage: a thread of any pool may ask.
    static thread_local std::unique_ptr<TileVoxels> voxels;
    if (!voxels) voxels = std::make_unique<TileVoxels>();
    m_maker->make(tile, *voxels);
    for (int k = 0; k < 8; ++k)
        made[k] = fillLeaf(
            (*voxels)[std::size_t(k)],
            tile.offsetBy(kLeafDim * (k >> 2), kLeafDim * (k >> 1 & 1), kLeafDim * (k & 1)));
    ++m_tiles;
}

// Puts a leaf behind the others. Returns its number, or kEmpty if it holds nothing.
int TileStore::fillLeaf(const BlockVoxels& voxels, const openvdb::Coord& origin) const
{
    LeafFiller::Sums sums;
    TreeLeaf leaf;
    const LeafFiller::Counts count = m_filler.sumDensities(voxels, origin, leaf, sums);
    const int voxel_count = leaf.count();
    if (voxel_count == 0) return kEmpty;
    const std::uint32_t entries = m_filler.listEntries(leaf, count);
    take(sizeof(TreeLeaf)
         + std::size_t(voxel_count)
             * (sizeof(VoxelRecord) + sizeof(float) + (m_has_ratios ? sizeof(ScatterRatio) : 0))
         + entries * sizeof(ListedRecord));
    const std::size_t number = m_leaves.append(1);
    leaf.first = std::uint32_t(m_records.append(std::size_t(voxel_count)));
    const std::uint32_t first_entry = entries > 0 ? std::uint32_t(m_listed.append(entries)) : 0;
    if (m_has_ratios) std::fill_n(m_scatter_ratio.data() + leaf.first, voxel_count, kHomogeneous);
    m_filler.writeRecords(
        voxels, count, sums,
        {leaf, m_density.data(), m_records.data(), m_listed.data(), m_scatter_ratio.data()},
        first_entry);
    m_leaves.data()[number] = leaf;
    m_voxels += std::uint64_t(voxel_count);
    return int(number);
}

std::vector<TileStore::Place> TileStore::sortedPlaces() const
{
    std::vector<Place> places = m_places;
    std::sort(places.begin(), places.end(),
              [](const Place& a, const Place& b) { return a.origin < b.origin; });
    return places;
}

void TileStore::make(const openvdb::CoordBBox& box,
                     const std::function<bool(const openvdb::Coord& tile)>& wanted) const
{
    openvdb::CoordBBox all = box;
    all.intersect(m_maker->bounds());
    if (all.empty()) return;
    const openvdb::Coord low = all.min() & ~(kNodeDim - 1);
    std::vector<openvdb::Coord> nodes;
    for (int x = low[0]; x <= all.max()[0]; x += kNodeDim)
        for (int y = low[1]; y <= all.max()[1]; y += kNodeDim)
            for (int z = low[2]; z <= all.max()[2]; z += kNodeDim) nodes.emplace_back(x, y, z);
    tbb::parallel_for(std::size_t(0), nodes.size(), [&](std::size_t i) {
        const openvdb::Coord& o = nodes[i];
        const int table = node(o[0], o[1], o[2]);
        if (table == kEmpty) return;
        tbb::parallel_for(0, kTilesOfNode, [&](int t) {
            const openvdb::Coord tile =
                o.offsetBy((t >> 6) * kTileDim, (t >> 3 & 7) * kTileDim, (t & 7) * kTileDim);
            if (all.hasOverlap({tile, tile.offsetBy(kTileDim - 1)}) && (!wanted || wanted(tile)))
                leafIn(table, tile[0], tile[1], tile[2]);
        });
    });
}

} // namespace volcomp
