// SPDX-License-Identifier: Apache-2.0
// One part of a box at its place among the voxels of a composite: which tiles it reaches, and what
// it adds to each.
#pragma once

#include <functional>

#include "volcomp/compose/blocked_light.h"
#include "volcomp/compose/box_kernel.h"
#include "volcomp/compose/box_source.h"
#include "volcomp/place/placement.h"
#include "volcomp/compose/tile_accumulator.h"
#include "volcomp/compose/voxel_tint.h"

namespace volcomp {

/// Coordinates and lengths are in voxels of the target unless a name says otherwise. Here the
/// target's voxel (i, j, k) is [i, i + 1) x [j, j + 1) x [k, k + 1).
class PlacedBox {
public:
    /// `voxel` is the edge of the target's voxels in world units, `blocked` the factor on the
    /// densities that are added. The placement and the part must outlive this.
    PlacedBox(const Placement& placement, const SourcePart& part, double voxel,
              const BlockedFactors& blocked = {});

    /// Calls `visit` with the coordinates of every tile of `among` that the box may reach into: the
    /// tile's first voxel divided by TileAccumulator::kSize. Without `among` it is every tile, and
    /// it throws Error if the box reaches further than 2^24 voxels from the origin.
    void forTiles(const openvdb::CoordBBox* among,
                  const std::function<void(const openvdb::Coord&)>& visit) const;

    /// Calls `visit` with ranges of tiles of `among` that together hold all that the box may add to
    /// these: the bounds of its voxels in ever smaller groups. `visit` returns whether it wants
    /// those of the smaller groups instead; `last` says that it is a voxel.
    void
    forGroups(const openvdb::CoordBBox& among,
              const std::function<bool(const openvdb::CoordBBox& tiles, bool last)>& visit) const;

    /// Adds what falls into the tile whose first voxel is `tile_origin`. The sum of directions is
    /// multiplied by `weight`, which is close to 1: the strongest of equal directions wins. `tint`
    /// may be null.
    void add(const openvdb::Coord& tile_origin, float weight, const VoxelTint* tint,
             TileAccumulator& tile) const;

private:
    friend class BoxTint;

    SourceBounds boundsOf(std::size_t list, std::size_t number) const;
    openvdb::CoordBBox tilesOf(const SourceBounds& bounds) const;
    BoxInTile inTile(const openvdb::Coord& tile_origin, float weight) const;
    /// Turns and scales a vector that is given in voxels of the box.
    Vec3d mapped(const Vec3f& p) const;
    /// Half the edges of the bounds of a turned cuboid, of which half the edges are given in voxels
    /// of the box.
    Vec3d span(const Vec3f& half) const;
    /// The place in the world of a place that is given in voxels of the box.
    Vec3d worldOf(const Vec3f& p) const;

    const Placement& m_placement;
    const SourcePart& m_part;
    double m_voxel;     ///< edge of the target's voxels, world units
    float m_axes[3][3]; ///< one voxel of the box along its x, y, z
    float m_turn[3][3]; ///< unit vectors of m_axes
    Vec3d m_root;       ///< the middle of the box's voxel (0,0,0)
    int m_divisions;    ///< of a voxel of the box along each edge
    float m_width;      ///< edge of the cube that each divided voxel adds
    /// Density that a cube adds to a voxel that it covers fully, for a density of 1 in the box.
    float m_density;
    float m_square; ///< that it adds to VoxelSum::kSquares, for a square of 1 in the box
};

/// Looks up the colour of a voxel tint at the voxels of one placed box. Both must outlive it.
class BoxTint {
public:
    BoxTint(const PlacedBox& box, const VoxelTint& tint);

    /// Multiplies the sum of the box's voxel `voxel` by the colour at its place.
    void apply(std::uint32_t voxel, VoxelSum& sum);

private:
    const PlacedBox& m_box;
    TintWalk m_walk;
};

/// Calls `visit` for all tiles of `among` that bounds in voxels of the target reach. Without
/// `among` it is all tiles, and if the bounds lie further than 2^24 voxels from the origin, it
/// throws an Error that begins with `what`.
void forTilesBetween(const Vec3d& low, const Vec3d& high, const openvdb::CoordBBox* among,
                     const char* what, const std::function<void(const openvdb::Coord&)>& visit);

} // namespace volcomp
