// SPDX-License-Identifier: Apache-2.0
// A volume whose voxels are made when they are first asked for, tile by tile: what the renderer
// takes from placed boxes without a file between.
#pragma once

#include <array>
#include <bitset>
#include <utility>
#include <vector>

#include <openvdb/math/BBox.h>

#include "volcomp/volume/block_source.h"

namespace volcomp {

/// Tiles of 16^3 voxels: two leaves along each edge.
constexpr int kTileDim = 16;
constexpr int kTilesOfNode = 512; ///< 8^3

/// The number of the tile that holds voxel (x, y, z) in its node of 128^3, z fastest.
constexpr int tileInNode(int x, int y, int z)
{
    return (x >> 4 & 7) << 6 | (y >> 4 & 7) << 3 | (z >> 4 & 7);
}

/// The particles of a tile's leaves, by 4 x + 2 y + z of the leaf in the tile.
using TileVoxels = std::array<BlockVoxels, 8>;

/// What makes the tiles of one volume. A tile depends on its place alone: not on who asked for it,
/// on what was made before, nor on the number of threads. Every function may be called from several
/// threads at once.
class TileMaker {
public:
    virtual ~TileMaker() = default;
    TileMaker(const TileMaker&) = delete;
    TileMaker& operator=(const TileMaker&) = delete;

    const std::vector<PartInfo>& parts() const { return m_parts; } ///< at least one
    /// Index space to world: cubic voxels.
    const openvdb::math::Transform& transform() const { return *m_transform; }
    /// All that may hold particles lies in these voxels; empty if nothing does. Whole leaves.
    const openvdb::CoordBBox& bounds() const { return m_bounds; }

    /// The tiles, by tileInNode(), that may hold particles, of the node whose first voxel this is.
    virtual std::bitset<kTilesOfNode> tiles(const openvdb::Coord& node) const = 0;
    /// Makes the voxels of the tile whose first voxel this is; `voxels` is overwritten, and its
    /// memory used again. Parts come in the order of parts(), in each leaf.
    virtual void make(const openvdb::Coord& tile, TileVoxels& voxels) const = 0;
    /// Lets go of what was kept of nodes, to save memory. No other function may run meanwhile.
    virtual void forget() { }
    /// Of all that is kept, now.
    virtual std::size_t memoryBytes() const = 0;

protected:
    TileMaker(std::vector<PartInfo> parts, openvdb::math::Transform::ConstPtr transform,
              const openvdb::CoordBBox& bounds)
        : m_parts(std::move(parts)), m_transform(std::move(transform)), m_bounds(bounds)
    {
    }

private:
    std::vector<PartInfo> m_parts;
    openvdb::math::Transform::ConstPtr m_transform;
    openvdb::CoordBBox m_bounds;
};

} // namespace volcomp
