// SPDX-License-Identifier: Apache-2.0
#include "volcomp/compose/tile_sources.h"

#include <algorithm>

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

namespace volcomp {
namespace {

// A tile's key sorts as an OpenVDB tree does down to its nodes of 128^3 voxels. From the highest
// bits down it holds x, y, z of the root's entry of 4096^3 voxels, then of the node in it, then of
// the tile in the node.
constexpr int kNodeBits = 7 - TileAccumulator::kLog2; ///< of a tile's coordinate within a node
constexpr int kEntryBits = 5;                         ///< of a node's within an entry
constexpr int kRootBits = 13;                         ///< of an entry's, which may be negative
constexpr int kRootBias = 1 << (kRootBits - 1);
static_assert(3 * (kRootBits + kEntryBits + kNodeBits) <= 64);
static_assert(TileAccumulator::kLog2 + kNodeBits + kEntryBits + kRootBits >= 25,
              "voxels from -2^24 to 2^24");

std::uint64_t tileKey(const openvdb::Coord& tile)
{
    std::uint64_t key = 0;
    const auto append = [&](int value, int bits) {
        key = key << bits | static_cast<std::uint64_t>(value & ((1 << bits) - 1));
    };
    for (int i = 0; i < 3; ++i)
        append((tile[i] >> (kEntryBits + kNodeBits)) + kRootBias, kRootBits);
    for (int i = 0; i < 3; ++i) append(tile[i] >> kNodeBits, kEntryBits);
    for (int i = 0; i < 3; ++i) append(tile[i], kNodeBits);
    return key;
}

/// The first voxel of a tile.
openvdb::Coord tileOrigin(std::uint64_t key)
{
    const auto takeLast = [&](int bits) {
        const auto value = static_cast<int>(key & ((std::uint64_t(1) << bits) - 1));
        key >>= bits;
        return value;
    };
    openvdb::Coord in_node, in_entry, entry;
    for (int i = 2; i >= 0; --i) in_node[i] = takeLast(kNodeBits);
    for (int i = 2; i >= 0; --i) in_entry[i] = takeLast(kEntryBits);
    for (int i = 2; i >= 0; --i) entry[i] = takeLast(kRootBits) - kRootBias;
    openvdb::Coord origin;
    for (int i = 0; i < 3; ++i)
        origin[i] = ((entry[i] * (1 << kEntryBits) + in_entry[i]) * (1 << kNodeBits) + in_node[i])
            * TileAccumulator::kSize;
    return origin;
}

} // namespace

TileSources::TileSources(const TargetSources& sources) : m_sources(sources) { findTiles(); }

void TileSources::compose(std::size_t tile, TileAccumulator& sums, VoxelStore& store,
                          std::vector<PackedBlock>& blocks) const
{
    const Entry* const entries = &m_entries[m_first[tile]];
    m_sources.compose(
        tileOrigin(entries->tile), sourceCount(tile),
        [&](std::size_t k) { return entries[k].source; }, sums, store, blocks);
}

/// The tiles that the placements [begin, end) reach.
std::vector<TileSources::Entry> TileSources::placementEntries(std::size_t begin,
                                                              std::size_t end) const
{
    std::vector<Entry> entries;
    for (std::size_t i = begin; i < end; ++i)
        m_sources.forTilesOf(i, nullptr, [&](const openvdb::Coord& tile) {
            entries.push_back({tileKey(tile), i});
        });
    return entries;
}

/// The tiles that the triangles of a skin reach, of which the first has the number `first_source`.
std::vector<TileSources::Entry> TileSources::skinEntries(const Skin& skin,
                                                         std::uint64_t first_source) const
{
    std::vector<Entry> entries;
    if (skin.material() != m_sources.material().material()) return entries;
    for (std::size_t t = 0; t < skin.surface().mesh().triangles.size(); ++t)
        m_sources.forTilesOf(skin, static_cast<std::int32_t>(t), nullptr,
                             [&](const openvdb::Coord& tile) {
                                 entries.push_back({tileKey(tile), first_source + t});
                             });
    return entries;
}

/// Lists the sources of every tile.
void TileSources::findTiles()
{
    constexpr std::size_t kChunk = 4096;
    const std::size_t count = m_sources.material().scene().boxes.size(),
                      chunks = (count + kChunk - 1) / kChunk;
    std::vector<std::vector<Entry>> lists(chunks);
    tbb::parallel_for(std::size_t(0), chunks, [&](std::size_t c) {
        lists[c] = placementEntries(c * kChunk, std::min(count, (c + 1) * kChunk));
    });
    std::uint64_t source = count;
    for (const Skin& skin : m_sources.material().skins()) {
        lists.push_back(skinEntries(skin, source));
        source += skin.surface().mesh().triangles.size();
    }
    std::size_t total = 0;
    for (const auto& list : lists) total += list.size();
    m_entries.reserve(total);
    for (auto& list : lists) {
        m_entries.insert(m_entries.end(), list.begin(), list.end());
        std::vector<Entry>().swap(list);
    }
    tbb::parallel_sort(m_entries.begin(), m_entries.end());
    for (std::size_t i = 0; i < m_entries.size(); ++i)
        if (i == 0 || m_entries[i].tile != m_entries[i - 1].tile) m_first.push_back(i);
    m_first.push_back(m_entries.size());
}

} // namespace volcomp
