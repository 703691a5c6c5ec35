// SPDX-License-Identifier: Apache-2.0
// A volume in memory as a maker of tiles, which counts what it makes.
#pragma once

#include <atomic>

#include "volcomp/volume/block_source.h"
#include "volcomp/volume/tile_maker.h"

namespace volcomp {

class VolumeTiles : public TileMaker {
public:
    explicit VolumeTiles(const Volume& volume)
        : TileMaker(VolumeSource(volume).parts(), VolumeSource(volume).transform().copy(),
                    boundsOf(volume)),
          m_source(volume)
    {
    }

    std::bitset<kTilesOfNode> tiles(const openvdb::Coord& node) const override
    {
        std::bitset<kTilesOfNode> tiles;
        if (!bounds().hasOverlap({node, node.offsetBy(kNodeDim - 1)})) return tiles;
        const NodeBlocks blocks = m_source.blocks(node);
        for (int n = 0; n < kNodeSize; ++n) {
            const openvdb::Coord o = leafInNode(n);
            if (blocks.voxels[n] || blocks.tiles[n]) tiles.set(tileInNode(o[0], o[1], o[2]));
        }
        return tiles;
    }
    void make(const openvdb::Coord& tile, TileVoxels& voxels) const override
    {
        ++made;
        const openvdb::Coord node = tile & ~(kNodeDim - 1);
        const NodeBlocks blocks = m_source.blocks(node);
        for (int k = 0; k < 8; ++k) {
            const openvdb::Coord leaf = tile.offsetBy(8 * (k >> 2), 8 * (k >> 1 & 1), 8 * (k & 1));
            const int n = numberInNode(leaf);
            if (blocks.voxels[n] || blocks.tiles[n]) m_source.take(leaf, voxels[k]);
            else voxels[k].assign(parts().size(), {});
        }
    }
    std::size_t memoryBytes() const override { return 0; }

    mutable std::atomic<int> made{0};

private:
    static openvdb::CoordBBox boundsOf(const Volume& volume)
    {
        openvdb::CoordBBox box;
        for (const VolumePart& part : volume.parts)
            box.expand(part.density->evalActiveVoxelBoundingBox());
        if (!box.empty()) box = {box.min() & ~7, (box.max() & ~7).offsetBy(7)};
        return box;
    }

    VolumeSource m_source;
};

} // namespace volcomp
