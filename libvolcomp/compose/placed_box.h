// One part of a box at its place among the voxels of a composite: which tiles it reaches, and what
// it adds to one.
#pragma once

#include <functional>

#include "volcomp/compose/box_kernel.h"
#include "volcomp/compose/box_source.h"
#include "volcomp/place/placement.h"
#include "volcomp/compose/tile_accumulator.h"
#include "volcomp/compose/voxel_tint.h"

namespace volcomp {

/// In voxels of the target, whose voxel (0,0,0) has its lowest corner at the origin.
class PlacedBox {
public:
    /// `voxel`: edge of the target's. The part must outlive this.
    PlacedBox(const Placement& placement, const SourcePart& part, double voxel);

    /// Calls `visit` with the coordinates (first voxel / kSize) of every tile that the box may
    /// reach into. Throws Error beyond 2^24 voxels.
    void forTiles(const std::function<void(const openvdb::Coord&)>& visit) const;

    /// Adds what falls into the tile whose first voxel is `tile_origin`. `tint` may be null.
    /// `weight`, close to 1, is what the directions count beside those of other placements.
    void add(const openvdb::Coord& tile_origin, float weight, const VoxelTint* tint,
             TileAccumulator& tile) const;

private:
    friend class BoxTint;
    BoxInTile inTile(const openvdb::Coord& tile_origin, float weight) const;
    Vec3d mapped(const Vec3f& p) const;  ///< a vector of the box's voxels
    Vec3d span(const Vec3f& half) const; ///< half extents of a box along the target's axes
    Vec3d worldOf(const Vec3f& p) const; ///< of a place in the box's voxels

    const Placement& m_placement;
    const SourcePart& m_part;
    double m_voxel;
    float m_axes[3][3]; ///< voxels of the target for a voxel of the box along its x, y, z
    float m_turn[3][3]; ///< the same, unit length
    Vec3d m_root;
    int m_divisions; ///< of a voxel, along an edge
    float m_width;   ///< edge of the cube that is added for each voxel (or each part of it)
    float m_density; ///< factor from the box's density to the density added where the cube covers a
                     ///< voxel fully
};

/// Looks up the colour of a voxel tint at the voxels of one placed box. All must outlive it.
class BoxTint {
public:
    BoxTint(const PlacedBox& box, const VoxelTint& tint);

    /// Multiplies the sum of the box's voxel `voxel` by the colour at its place.
    void apply(std::uint32_t voxel, VoxelSum& sum);

private:
    const PlacedBox& m_box;
    TintWalk m_walk;
};

/// Calls `visit` for the tiles that a box reaches. `what` names it in the Error for a place beyond
/// 2^24 voxels.
void forTilesBetween(const Vec3d& low, const Vec3d& high, const char* what,
                     const std::function<void(const openvdb::Coord&)>& visit);

} // namespace volcomp
