// SPDX-License-Identifier: Apache-2.0
// The sources of one material, sorted by the tiles that they reach. compose() and its estimate work
// through them.
#pragma once

#include <cstdint>
#include <vector>

#include "volcomp/compose/material_sources.h"

namespace volcomp {

/// What adds to each tile of a composite.
class TileSources {
public:
    /// The argument must outlive it.
    explicit TileSources(const TargetSources& sources);

    PackedPart emptyPart() const { return m_sources.emptyPart(); }

    /// Tiles are numbered in the order of an OpenVDB tree's nodes of 128^3 voxels; those of one
    /// node follow each other.
    std::size_t tileCount() const { return m_first.size() - 1; }
    /// A number that only tiles of the same node share.
    std::uint64_t node(std::size_t tile) const
    {
        return m_entries[m_first[tile]].tile >> 3 * (7 - TileAccumulator::kLog2);
    }
    std::size_t sourceCount(std::size_t tile) const { return m_first[tile + 1] - m_first[tile]; }

    /// Sums the tile's sources and appends its blocks, whose values are put into the store. For
    /// several threads at once if each has its own arguments.
    void compose(std::size_t tile, TileAccumulator& sums, VoxelStore& store,
                 std::vector<PackedBlock>& blocks) const;

    std::size_t bytes() const ///< of the lists
    {
        return m_entries.capacity() * sizeof(Entry) + m_first.capacity() * sizeof(std::size_t);
    }

private:
    /// A source of one tile.
    struct Entry {
        std::uint64_t tile;   ///< its key, see tile_sources.cpp
        std::uint64_t source; ///< number of a placement, or behind them of a skin's triangle
        bool operator<(const Entry& other) const
        {
            return tile != other.tile ? tile < other.tile : source < other.source;
        }
    };

    std::vector<Entry> placementEntries(std::size_t begin, std::size_t end) const;
    std::vector<Entry> skinEntries(const Skin& skin, std::uint64_t first_source) const;
    void findTiles();

    const TargetSources& m_sources;
    std::vector<Entry> m_entries;
    std::vector<std::size_t> m_first; ///< entry of each tile, and the end
};

} // namespace volcomp
