// SPDX-License-Identifier: Apache-2.0
// The sources of one material, at one voxel of the target: what they add to a tile. What is
// composed as a whole and what is made tile by tile stand on this.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "volcomp/compose/box_pyramids.h"
#include "volcomp/compose/compose_params.h"
#include "volcomp/compose/placed_box.h"
#include "volcomp/compose/skin.h"
#include "volcomp/compose/tile_accumulator.h"
#include "volcomp/compose/voxel_tint.h"

namespace volcomp {

/// One material of a scene, whatever the voxel. Its sources have numbers: those of the placements,
/// and behind these the triangles of all skins that are voxels, skin by skin. A number may be that
/// of another material's source.
class MaterialSources {
public:
    /// The arguments must outlive it. Throws Error if the sources differ in their kind.
    MaterialSources(const BoxSources& packed, const PlacedScene& scene, std::string material);

    const std::string& material() const { return m_material; }
    const BoxSources& packed() const { return m_packed; }
    const PlacedScene& scene() const { return m_scene; }
    const std::vector<Skin>& skins() const { return m_skins; } ///< of all materials
    /// A part without voxels that has the material's kind and what voxels will hold, but for
    /// scatter ratios: whether they have these depends on the target's voxel.
    PackedPart emptyPart() const;

    static constexpr int kNone = -1;
    /// The number of this material among those of the box, or kNone if it adds nothing.
    int ofBox(std::size_t box) const { return m_of_box[box]; }
    /// The voxel tint of a placement; without a colour if it has none.
    VoxelTint tintOf(std::size_t placement) const;

private:
    void findInBoxes();
    void findKind();
    void findColours();
    const SourcePart* ownPart(const Placement& p) const;
    bool hasVoxelTint(const Placement& p) const;

    const BoxSources& m_packed;
    const PlacedScene& m_scene;
    std::vector<Skin> m_skins;
    std::string m_material;
    std::vector<int> m_of_box; ///< see ofBox()
    MaterialKind m_kind = MaterialKind::fibre;
    bool m_direction = false, m_colour = false, m_own_share = false;
    Vec3f m_uniform{1.0f}; ///< the colour if all sources have the same
};

/// One material at the target's voxel `params.voxel`. Only reads, so several threads may use it.
class TargetSources {
public:
    /// `material` and `blocked`, the factors for this voxel, must outlive it.
    TargetSources(const MaterialSources& material, const BlockedTable& blocked,
                  const ComposeParams& params);

    const MaterialSources& material() const { return m_material; }
    /// A part without voxels that has the material's kind and what voxels will hold.
    PackedPart emptyPart() const;

    /// Calls `visit` for the tiles that a placement may reach, see PlacedBox::forTiles(). `among`
    /// are coordinates of tiles; null: all, and then placements that reach too far are errors.
    void forTilesOf(std::size_t placement, const openvdb::CoordBBox* among,
                    const std::function<void(const openvdb::Coord&)>& visit) const;
    /// See PlacedBox::forGroups().
    void
    forGroupsOf(std::size_t placement, const openvdb::CoordBBox& among,
                const std::function<bool(const openvdb::CoordBBox& tiles, bool last)>& visit) const;
    /// The same as forTilesOf() for a triangle of one of the material's own skins.
    void forTilesOf(const Skin& skin, std::int32_t triangle, const openvdb::CoordBBox* among,
                    const std::function<void(const openvdb::Coord&)>& visit) const;

    /// Sums sources into a tile and appends its blocks, whose values are put into the store.
    /// `source`(k) is the number of the k-th of `count` sources: all that reach the tile, in
    /// increasing order.
    template <class SourceAt>
    void compose(const openvdb::Coord& origin, std::size_t count, const SourceAt& source,
                 TileAccumulator& sums, VoxelStore& store, std::vector<PackedBlock>& blocks) const
    {
        for (std::size_t k = 0; k < count; ++k) {
            // If directions are equally strong, the earlier placement's wins (MODEL section 8): it
            // counts for up to 1/4096 more, which is less than a half float shows.
            add(source(k), 1 + float(count - k) / float(count) / 4096, origin, sums);
        }
        sums.finish(origin, m_minimum, m_values, store, blocks);
    }

private:
    struct LevelOfBox {
        const SourcePart* part = nullptr;
        const BlockedFactors* blocked = nullptr;
    };
    LevelOfBox levelOf(const Placement& p) const;
    PlacedBox placed(const Placement& p, const LevelOfBox& level) const
    {
        return {p, *level.part, m_voxel, *level.blocked};
    }
    void add(std::uint64_t source, float weight, const openvdb::Coord& origin,
             TileAccumulator& sums) const;

    const MaterialSources& m_material;
    const BlockedTable& m_blocked;
    const std::vector<Placement>& m_placements;
    double m_voxel;
    float m_minimum; ///< density
    VoxelValues m_values;
};

} // namespace volcomp
