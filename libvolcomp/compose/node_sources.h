// SPDX-License-Identifier: Apache-2.0
// The sources of the tiles of one node of 128^3 voxels.
#pragma once

#include <bitset>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "volcomp/compose/material_sources.h"
#include "volcomp/compose/source_tree.h"
#include "volcomp/volume/tile_maker.h"

namespace volcomp {

/// Lists for each material and tile that sources reach, in the order in which they are added. Tiles
/// that lie in the bounds of boxes alone, and not where their voxels are, have no lists.
class NodeSources {
public:
    /// For the node whose first voxel is `node`. `materials` are all at the same `voxel`. Throws
    /// Error if there are 2^32 sources or more in it.
    NodeSources(const SourceTree& tree, const std::vector<TargetSources>& materials, double voxel,
                const openvdb::Coord& node);

    bool empty() const { return m_sources.empty(); }
    std::bitset<kTilesOfNode> tiles() const; ///< that have sources, by tileInNode()

    struct List {
        const std::uint32_t* first;
        std::size_t count;
    };
    /// The numbers of the sources (MaterialSources) of a tile, in increasing order.
    List list(std::size_t material, int tile) const;

    std::size_t memoryBytes() const;

private:
    /// The list of one material and tile: it begins at m_sources[first] and ends where the next
    /// one begins.
    struct Run {
        std::uint32_t key; ///< kTilesOfNode times the material, and the tile
        std::uint32_t first;
    };
    void setLists(const std::vector<std::uint64_t>& sorted);

    std::vector<Run> m_runs; ///< by key
    std::vector<std::uint32_t> m_sources;
};

} // namespace volcomp
