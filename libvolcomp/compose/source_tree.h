// SPDX-License-Identifier: Apache-2.0
// The sources of a scene by place: which placements, and which triangles of skins that are voxels,
// may add something to a part of space.
#pragma once

#include <cstdint>
#include <vector>

#include "volcomp/base/vec.h"
#include "volcomp/compose/bounds_tree.h"
#include "volcomp/compose/box_pyramids.h"
#include "volcomp/compose/skin.h"
#include "volcomp/place/placed_scene.h"

namespace volcomp {

/// The bounds of placements are those of the turned box in its own voxels, in the world. What is
/// composed reaches further, by less than kSpread voxels of the target.
class SourceTree {
public:
    static constexpr double kSpread = 2; ///< of placements; skins reach 1 and their depth

    /// The arguments must outlive it, and the skins are those of the scene. Throws Error if there
    /// are 2^32 placements and triangles.
    SourceTree(const BoxSources& packed, const PlacedScene& scene, const std::vector<Skin>& skins);

    /// Calls `visit` with the number of each placement whose bounds meet the box, in an order of
    /// the tree's own. Placements of boxes without voxels are left out.
    template <class Visit>
    void forPlacements(const openvdb::BBoxd& box, const Visit& visit) const
    {
        m_placements.query(box, [&](std::uint32_t i) {
            if (boundsOfPlacement(i).hasOverlap(box)) visit(i);
        });
    }
    /// Calls `visit` with the number of each triangle whose bounds meet the box, counted over all
    /// skins.
    template <class Visit>
    void forTriangles(const openvdb::BBoxd& box, const Visit& visit) const
    {
        m_triangles.query(box, [&](std::uint32_t t) {
            if (boundsOfTriangle(t).hasOverlap(box)) visit(t);
        });
    }

    /// How far skins reach beyond their triangles, in voxels of the target.
    double skinSpread() const { return m_skin_spread; }
    /// The bounds of all that is composed with this voxel, in the world; empty: nothing is.
    openvdb::BBoxd bounds(double voxel) const;
    std::size_t memoryBytes() const
    {
        return m_placements.memoryBytes() + m_triangles.memoryBytes();
    }

private:
    openvdb::BBoxd boundsOfPlacement(std::uint32_t placement) const;
    openvdb::BBoxd boundsOfTriangle(std::uint32_t triangle) const;

    struct BoxBounds {
        Vec3d centre{0.0}, half{-1.0}; ///< in the box's own space; half < 0: it has no voxels
    };
    static BoxBounds boundsOfBox(const Pyramids& parts);

    const std::vector<Placement>& m_list;
    const std::vector<Skin>& m_skins;
    std::vector<BoxBounds> m_boxes;
    double m_skin_spread = 0;
    BoundsTree m_placements, m_triangles;
};

} // namespace volcomp
