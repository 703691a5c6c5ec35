// SPDX-License-Identifier: Apache-2.0
// The sources of one material, sorted by the tiles that they reach. compose() and its estimate work
// through them.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "volcomp/compose/box_source.h"
#include "volcomp/compose/compose.h"
#include "volcomp/compose/skin.h"
#include "volcomp/compose/tile_accumulator.h"
#include "volcomp/compose/voxel_tint.h"

namespace volcomp {

/// One part of a box: with its own voxels, with voxels of twice the edge (coarsen()), and so on as
/// far as placements need it.
using Pyramid = std::vector<SourcePart>;
using Pyramids = std::vector<Pyramid>; ///< one for each material of a box

/// Boxes packed for a voxel size, and the materials in the order in which they appear.
struct BoxSources {
    std::vector<Pyramids> boxes;
    std::vector<std::string> materials;
};

/// Packs the boxes that are placed. `voxel` is the target's edge. With Kept::blocked_light
/// findBlocked() is to follow, which an estimate does without. Throws the Errors of packPart().
BoxSources packBoxes(const std::vector<Box>& boxes, const PlacedScene& scene, double voxel,
                     Kept keep);

/// Finds SourcePart::blocked for what packBoxes() packed for the same scene and voxel.
void findBlocked(const PlacedScene& scene, double voxel, BoxSources& packed);

/// What adds to each tile of a composite. The arguments of the constructor must outlive it.
class TileSources {
public:
    TileSources(const std::vector<Pyramids>& boxes, const PlacedScene& scene,
                const ComposeParams& params, std::string material);

    /// A part without voxels that has the material's kind and what voxels will hold.
    PackedPart emptyPart() const;

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

    const SourcePart* partOf(const Placement& p) const;
    bool hasVoxelTint(const Placement& p) const;
    VoxelTint tintOf(std::size_t placement) const;
    void findKind();
    void findColours();
    std::vector<Entry> placementEntries(std::size_t begin, std::size_t end) const;
    std::vector<Entry> skinEntries(const Skin& skin, std::uint64_t first_source) const;
    void findTiles();

    const std::vector<Pyramids>& m_boxes;
    const PlacedScene& m_scene;
    const std::vector<Placement>& m_placements; ///< of m_scene
    std::vector<Skin> m_skins;
    const ComposeParams& m_params;
    std::string m_material;
    MaterialKind m_kind = MaterialKind::fibre;
    bool m_direction = false, m_colour = false, m_scatter_ratio = false, m_own_share = false;
    Vec3f m_uniform{1.0f}; ///< the colour if all sources have the same
    std::vector<Entry> m_entries;
    std::vector<std::size_t> m_first; ///< entry of each tile, and the end
};

} // namespace volcomp
