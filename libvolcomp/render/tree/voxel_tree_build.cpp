// SPDX-License-Identifier: Apache-2.0
// How a VoxelTree is made from a source.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <mutex>
#include <string>
#include <tuple>

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "volcomp/base/error.h"
#include "volcomp/render/tree/voxel_tree.h"

namespace volcomp {
namespace {

using openvdb::Coord;

int countOf(const VoxelMask& mask)
{
    int count = 0;
    for (const std::uint64_t word : mask) count += __builtin_popcountll(word);
    return count;
}

// Leaves the voxels of a mask out, whose numbers in the lists are `keep`.
template <class T>
void keepOnly(const std::vector<std::size_t>& keep, std::vector<T>& list)
{
    if (list.size() <= 1) return; // one value for all
    for (std::size_t k = 0; k < keep.size(); ++k) list[k] = list[keep[k]];
    list.resize(keep.size());
}

// The least density below 0: where and in which part.
struct Negative {
    float least = 0;
    Coord leaf;
    int voxel = 0;
    std::size_t part = 0;

    // The first of the lowest, so that it does not depend on the order of the threads.
    void add(const Negative& other)
    {
        const auto key = [](const Negative& n) {
            return std::tie(n.least, n.leaf, n.voxel, n.part);
        };
        if (other.least < 0 && (least == 0 || key(other) < key(*this))) *this = other;
    }
};

// Leaves voxels of a density below 0 out.
void dropNegative(const Coord& leaf, std::size_t number, PartVoxels& part, Negative& found)
{
    if (std::none_of(part.density.begin(), part.density.end(),
                     [](float d) { return d < 0 && std::isfinite(d); }))
        return;
    VoxelMask mask{};
    std::vector<std::size_t> keep;
    forEachVoxelOf(part.mask, [&](int n, std::size_t k) {
        const float density = PartVoxels::at(part.density, k, 0.0f);
        if (density < 0 && std::isfinite(density)) {
            found.add({density, leaf, n, number});
            return;
        }
        mask[n >> 6] |= std::uint64_t(1) << (n & 63);
        keep.push_back(k);
    });
    part.mask = mask;
    keepOnly(keep, part.density);
    keepOnly(keep, part.direction);
    keepOnly(keep, part.colour);
    keepOnly(keep, part.scatter_ratio);
    keepOnly(keep, part.own_share);
    if (keep.empty()) part.clear();
}

} // namespace

// Fills the tables from a source: first the places, and how much each leaf may need at most; then,
// in parallel, the voxels. So each block is taken once, and the source can read it from a file and
// free it on the way.
class VoxelTree::Builder {
public:
    Builder(VoxelTree& tree, const BlockSource& source)
        : m_tree(tree), m_source(source), m_filler(source.parts())
    {
    }

    void run(const Progress& progress)
    {
        for (const PartInfo& part : m_source.parts()) {
            m_tree.m_parts.push_back({part.material, part.kind});
        }
        m_tree.m_warnings = m_source.warnings();
        m_tree.setTransform(m_source.transform());
        addNodes();
        makeRoom();
        fill(progress);
        seeToNegative();
        std::vector<std::uint64_t> uses;
        for (const Place& place : m_places) uses.push_back(place.uses);
        m_tree.finish(uses);
    }

private:
    struct Place { // of a leaf; the first of a tile's
        Coord origin;
        bool tile;
        std::uint64_t uses;      // places that have the leaf
        std::uint32_t first = 0; // of the list entries that it may need
    };

    std::size_t partCount() const { return m_source.parts().size(); }

    void addNodes()
    {
        const std::vector<Coord> nodes = m_source.nodes();
        m_tree.m_places = NodeTable(nodes.size());
        for (const Coord& node : nodes) {
            const int table = addTable(node);
            if (table == kEmpty) continue;
            for (int a = 0; a < 3; ++a)
                if (std::abs(std::int64_t(node[a])) >> 27)
                    throw Error(
                        "the volume reaches beyond 134 million voxels from its origin; move it or use a larger voxel");
            m_tree.m_places.insert(node, table);
        }
    }

    // Adds the leaves of a node. Returns the number of their table, or kEmpty if there are none.
    int addTable(const Coord& node)
    {
        const NodeBlocks blocks = m_source.blocks(node);
        if (blocks.one_tile) {
            const int leaf = tileLeaf(node, kNodeSize);
            if (leaf == kEmpty) return kEmpty;
            m_tree.m_bounds.expand(openvdb::CoordBBox(node, node.offsetBy(kNodeDim - 1)));
            const auto [at, fresh] = m_tile_tables.emplace(leaf, 0);
            if (fresh) at->second = m_tree.m_places.addTable(leaf);
            return at->second;
        }
        int table = kEmpty;
        for (int n = 0; n < kNodeSize; ++n) {
            if (!blocks.voxels[n] && !blocks.tiles[n]) continue;
            const Coord block = node + leafInNode(n);
            int leaf = int(m_places.size());
            if (blocks.voxels[n]) m_places.push_back({block, false, 1});
            else leaf = tileLeaf(block, 1);
            if (leaf == kEmpty) continue;
            if (table == kEmpty) table = m_tree.m_places.addTable();
            m_tree.m_places.leaves(table)[n] = leaf;
            m_tree.m_bounds.expand(openvdb::CoordBBox(block, block.offsetBy(kLeafDim - 1)));
        }
        return table;
    }

    // The leaf of a tile, which is the same for all tiles of the same values; kEmpty if it holds
    // nothing.
    int tileLeaf(const Coord& block, std::uint64_t uses)
    {
        take(block, m_tile, m_negative);
        std::vector<std::uint32_t> key; // bits of all values: NaN is equal to itself
        const auto add = [&](float value) {
            std::uint32_t bits = 0;
            std::memcpy(&bits, &value, sizeof(bits));
            key.push_back(bits);
        };
        bool any = false;
        for (const PartVoxels& part : m_tile) {
            any |= !part.density.empty();
            add(part.density.empty() ? 0 : part.density[0]);
            add(part.own_share.empty() ? 0 : part.own_share[0]);
            for (const auto* list : {&part.direction, &part.colour, &part.scatter_ratio})
                for (int c = 0; c < 3; ++c) add(list->empty() ? 0 : (*list)[0][c]);
        }
        if (!any) return kEmpty;
        const auto [at, fresh] = m_tile_leaves.emplace(std::move(key), int(m_places.size()));
        if (fresh) m_places.push_back({block, true, 0});
        m_places[at->second].uses += uses;
        return at->second;
    }

    // Takes a block without voxels of a density below 0.
    void take(const Coord& block, BlockVoxels& voxels, Negative& found) const
    {
        m_source.take(block, voxels);
        for (std::size_t p = 0; p < voxels.size(); ++p) dropNegative(block, p, voxels[p], found);
    }

    // Tiny densities below 0 count as 0, others are an error.
    void seeToNegative()
    {
        if (m_negative.least == 0) return;
        const PartInfo& part = m_source.parts()[m_negative.part];
        float largest = 0;
        for (const float density : m_tree.m_density) largest = std::max(largest, density);
        if (m_negative.least < -kTinyNegative * largest)
            throw badDensity(part, m_negative.leaf, m_negative.voxel, m_negative.least);
        m_tree.m_warnings.push_back((m_source.file().empty() ? "" : m_source.file() + ": ")
                                    + negativeDensities(part.grid, m_negative.least));
    }

    // The sizes of all tables, from what the source may hold.
    void makeRoom()
    {
        m_tree.m_leaves.resize(m_places.size());
        std::uint64_t records = 0, entries = 0;
        for (std::size_t i = 0; i < m_places.size(); ++i) {
            m_tree.m_leaves[i].first = std::uint32_t(records);
            m_places[i].first = std::uint32_t(entries);
            const auto [more_records, more_entries] = upperBounds(m_places[i]);
            records += more_records;
            entries += more_entries;
        }
        if (std::max(records, entries) >> 32)
            throw Error("the volume has more voxels than 2^32; use a larger voxel");
        m_tree.m_records.resize(records);
        m_tree.m_density.resize(records);
        m_tree.m_listed.resize(entries);
        if (std::any_of(m_source.parts().begin(), m_source.parts().end(),
                        [](const PartInfo& part) { return part.has_scatter_ratio; }))
            m_tree.m_scatter_ratio.resize(records, kHomogeneous);
    }

    // How many records and list entries a leaf needs at most.
    std::pair<std::uint64_t, std::uint64_t> upperBounds(const Place& place) const
    {
        const std::size_t parts = partCount();
        if (place.tile) return {1, parts > 1 ? parts : 0};
        VoxelMask any{}, several{};
        std::vector<VoxelMask> masks(parts);
        for (std::size_t p = 0; p < parts; ++p) {
            masks[p] = m_source.mayHold(place.origin, p);
            for (int w = 0; w < 8; ++w) {
                several[w] |= any[w] & masks[p][w];
                any[w] |= masks[p][w];
            }
        }
        const VoxelMask& listed = parts > VoxelRecord::kMostParts ? any : several;
        std::uint64_t entries = 0;
        for (const VoxelMask& mask : masks)
            for (int w = 0; w < 8; ++w) entries += __builtin_popcountll(mask[w] & listed[w]);
        return {countOf(any), entries};
    }

    void fill(const Progress& progress)
    {
        std::mutex mutex;
        std::size_t done = 0;
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, m_places.size(), 64),
                          [&](const auto& range) {
                              BlockVoxels voxels;
                              Negative negative;
                              for (std::size_t i = range.begin(); i < range.end(); ++i) {
                                  take(m_places[i].origin, voxels, negative);
                                  fillLeaf(i, voxels);
                              }
                              const std::lock_guard<std::mutex> lock(mutex);
                              m_negative.add(negative);
                              done += range.size();
                              report(progress, double(done) / double(m_places.size()));
                          });
    }

    void fillLeaf(std::size_t index, const BlockVoxels& voxels)
    {
        Leaf& l = m_tree.m_leaves[index];
        l.uniform = m_places[index].tile;
        LeafFiller::Sums sums;
        const LeafFiller::Counts count =
            m_filler.sumDensities(voxels, m_places[index].origin, l, sums);
        m_filler.writeRecords(voxels, count, sums,
                              {l, m_tree.m_density.data(), m_tree.m_records.data(),
                               m_tree.m_listed.data(), m_tree.m_scatter_ratio.data()},
                              m_places[index].first);
    }

    VoxelTree& m_tree;
    const BlockSource& m_source;
    const LeafFiller m_filler;
    std::vector<Place> m_places; // by leaf
    std::map<std::vector<std::uint32_t>, int> m_tile_leaves;
    std::map<int, int> m_tile_tables; // of nodes that are one tile, by its leaf
    BlockVoxels m_tile;
    Negative m_negative;
};

VoxelTree::VoxelTree(const BlockSource& source, const Progress& progress)
{
    Builder(*this, source).run(progress);
}

} // namespace volcomp
