// SPDX-License-Identifier: Apache-2.0
#include "volcomp/compose/material_sources.h"

#include <algorithm>
#include <optional>

#include "volcomp/base/error.h"

namespace volcomp {

MaterialSources::MaterialSources(const BoxSources& packed, const PlacedScene& scene,
                                 std::string material)
    : m_packed(packed), m_scene(scene), m_skins(skinsOf(scene)), m_material(std::move(material))
{
    findInBoxes();
    findKind();
    findColours();
}

PackedPart MaterialSources::emptyPart() const
{
    PackedPart part;
    part.material = m_material;
    part.kind = m_kind;
    part.has_direction = m_direction;
    part.has_colour = m_colour;
    part.has_own_share = m_own_share;
    if (!m_colour) part.uniform_colour = m_uniform;
    return part;
}

bool MaterialSources::hasVoxelTint(const Placement& p) const
{
    return p.layer < m_scene.layers.size() && m_scene.layers[p.layer].tints_voxels;
}

VoxelTint MaterialSources::tintOf(std::size_t placement) const
{
    const Placement& p = m_scene.boxes.placements[placement];
    if (!hasVoxelTint(p)) return {};
    const PlacedLayer& layer = m_scene.layers[p.layer];
    return {&m_scene.surfaces[layer.surface].surface, &layer.tint,
            m_scene.boxes.triangle(placement)};
}

void MaterialSources::findInBoxes()
{
    m_of_box.assign(m_packed.boxes.size(), kNone);
    for (std::size_t b = 0; b < m_of_box.size(); ++b) {
        const Pyramids& parts = m_packed.boxes[b];
        const auto of_this = std::find_if(parts.begin(), parts.end(), [&](const Pyramid& levels) {
            return levels[0].material == m_material;
        });
        if (of_this != parts.end() && !(*of_this)[0].voxels.empty())
            m_of_box[b] = static_cast<int>(of_this - parts.begin());
    }
}

/// The placement's part of this material in the box's own voxels; null if it adds nothing.
const SourcePart* MaterialSources::ownPart(const Placement& p) const
{
    const int part = m_of_box[p.box];
    return part == kNone ? nullptr : &m_packed.boxes[p.box][static_cast<std::size_t>(part)][0];
}

/// Finds the kind, on which all sources have to agree.
void MaterialSources::findKind()
{
    const SourcePart* first = nullptr;
    const auto differs = [&](const std::string& other) {
        return Error("compose: expected one kind of material '" + m_material + "', found that box '"
                     + first->box + "' and " + other
                     + " differ: one is a fibre, the other a surface. Bake the boxes again.");
    };
    for (const Placement& p : m_scene.boxes.placements)
        if (const SourcePart* part = ownPart(p)) {
            if (!first) first = part;
            if (part->kind != first->kind) throw differs("box '" + part->box + "'");
        }
    if (first) m_kind = first->kind;
    for (const Skin& skin : m_skins)
        if (skin.material() == m_material) {
            m_kind = MaterialKind::surface;
            if (first && first->kind != m_kind) throw differs("the skin of a surface");
        }
}

/// Finds whether voxels need directions, own shares and colours, and if not, the one colour.
/// Coarser voxels of a box have these as its own do.
void MaterialSources::findColours()
{
    std::optional<Vec3f> shared;
    const auto noteColour = [&](const Vec3f& c) {
        if (!shared) shared = c;
        else if (*shared != c) m_colour = true;
    };
    for (const Placement& p : m_scene.boxes.placements)
        if (const SourcePart* part = ownPart(p)) {
            m_direction = m_direction || part->has_direction;
            m_own_share = m_own_share || !part->squares.empty();
            if (part->has_colour || hasVoxelTint(p)) m_colour = true;
            else
                noteColour(Vec3f(part->colour[0] * p.tint[0], part->colour[1] * p.tint[1],
                                 part->colour[2] * p.tint[2]));
        }
    for (const Skin& skin : m_skins)
        if (skin.material() == m_material) {
            m_direction = m_own_share = true;
            if (skin.hasColour()) m_colour = true;
            else noteColour(skin.colour({}));
        }
    m_uniform = shared.value_or(Vec3f(1.0f));
}

TargetSources::TargetSources(const MaterialSources& material, const BlockedTable& blocked,
                             const ComposeParams& params)
    : m_material(material), m_blocked(blocked), m_placements(material.scene().boxes.placements),
      m_voxel(params.voxel),
      m_minimum(
          static_cast<float>(std::max(params.minimum_density, params.minimum_depth / params.voxel)))
{
    const PackedPart part = material.emptyPart();
    m_values = {part.has_direction, part.has_colour, false, part.has_own_share};
    for (std::size_t b = 0; b < material.packed().boxes.size(); ++b)
        if (material.ofBox(b) != MaterialSources::kNone) {
            Placement smallest; // it has the coarsest voxels
            smallest.box = static_cast<std::uint16_t>(b);
            smallest.scale = material.packed().scales[b].smallest;
            if (!levelOf(smallest).part->scatter_ratios.empty()) m_values.scatter_ratio = true;
        }
}

PackedPart TargetSources::emptyPart() const
{
    PackedPart part = m_material.emptyPart();
    part.has_scatter_ratio = m_values.scatter_ratio;
    return part;
}

/// The level that the placement needs; null if its box has nothing of the material.
TargetSources::LevelOfBox TargetSources::levelOf(const Placement& p) const
{
    const int of_box = m_material.ofBox(p.box);
    if (of_box == MaterialSources::kNone) return {};
    const auto part = static_cast<std::size_t>(of_box);
    const Pyramid& levels = m_material.packed().boxes[p.box][part];
    const auto level = std::min(
        static_cast<std::size_t>(levelFor(levels[0].voxel * p.scale / m_voxel)), levels.size() - 1);
    return {&levels[level], &m_blocked[p.box][part][level]};
}

void TargetSources::forTilesOf(std::size_t placement, const openvdb::CoordBBox* among,
                               const std::function<void(const openvdb::Coord&)>& visit) const
{
    const Placement& p = m_placements[placement];
    if (const LevelOfBox level = levelOf(p); level.part) placed(p, level).forTiles(among, visit);
}

void TargetSources::forGroupsOf(
    std::size_t placement, const openvdb::CoordBBox& among,
    const std::function<bool(const openvdb::CoordBBox& tiles, bool last)>& visit) const
{
    const Placement& p = m_placements[placement];
    if (const LevelOfBox level = levelOf(p); level.part) placed(p, level).forGroups(among, visit);
}

void TargetSources::forTilesOf(const Skin& skin, std::int32_t triangle,
                               const openvdb::CoordBBox* among,
                               const std::function<void(const openvdb::Coord&)>& visit) const
{
    const openvdb::BBoxd bounds = skin.bounds(triangle, m_voxel);
    forTilesBetween(bounds.min(), bounds.max(), among, "skin", visit);
}

void TargetSources::add(std::uint64_t source, float weight, const openvdb::Coord& origin,
                        TileAccumulator& sums) const
{
    if (source < m_placements.size()) {
        const Placement& p = m_placements[source];
        const VoxelTint tint = m_material.tintOf(source);
        placed(p, levelOf(p)).add(origin, weight, tint.colour ? &tint : nullptr, sums);
        return;
    }
    source -= m_placements.size();
    for (const Skin& skin : m_material.skins()) {
        const std::size_t triangles = skin.surface().mesh().triangles.size();
        if (source < triangles) {
            skin.add(static_cast<std::int32_t>(source), m_voxel, origin, sums);
            return;
        }
        source -= triangles;
    }
}

} // namespace volcomp
