// SPDX-License-Identifier: Apache-2.0
#include "volcomp/compose/tile_sources.h"

#include <algorithm>

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include "volcomp/base/error.h"
#include "volcomp/compose/coarsen.h"
#include "volcomp/compose/placed_box.h"

namespace volcomp {
namespace {

/// Level of the pyramid for a box whose voxel, as placed, has `step` times the edge of the
/// target's: the coarsest level whose voxels are not larger than the target's.
int levelFor(double step)
{
    int level = 0;
    for (; level < 24 && step <= 0.5; step *= 2) ++level;
    return level;
}

// A tile's key sorts as an OpenVDB tree does down to its nodes of 128^3 voxels. From the highest
// bits down it holds x, y, z of the root's entry of 4096^3 voxels, then of the node in it, then of
// the tile in the node.
constexpr int kNodeBits = 7 - TileAccumulator::kLog2; ///< of a tile's coordinate within a node
constexpr int kEntryBits = 5;                         ///< of a node's within an entry
constexpr int kRootBits = 13;                         ///< of an entry's, which may be negative
constexpr int kRootBias = 1 << (kRootBits - 1);
static_assert(3 * (kRootBits + kEntryBits + kNodeBits) <= 64);
static_assert(TileAccumulator::kLog2 + kNodeBits + kEntryBits + kRootBits >= 25,
              "voxels from -2^24 to 2^24");

std::uint64_t tileKey(const openvdb::Coord& tile)
{
    std::uint64_t key = 0;
    const auto append = [&](int value, int bits) {
        key = key << bits | static_cast<std::uint64_t>(value & ((1 << bits) - 1));
    };
    for (int i = 0; i < 3; ++i)
        append((tile[i] >> (kEntryBits + kNodeBits)) + kRootBias, kRootBits);
    for (int i = 0; i < 3; ++i) append(tile[i] >> kNodeBits, kEntryBits);
    for (int i = 0; i < 3; ++i) append(tile[i], kNodeBits);
    return key;
}

/// The first voxel of a tile.
openvdb::Coord tileOrigin(std::uint64_t key)
{
    const auto takeLast = [&](int bits) {
        const auto value = static_cast<int>(key & ((std::uint64_t(1) << bits) - 1));
        key >>= bits;
        return value;
    };
    openvdb::Coord in_node, in_entry, entry;
    for (int i = 2; i >= 0; --i) in_node[i] = takeLast(kNodeBits);
    for (int i = 2; i >= 0; --i) in_entry[i] = takeLast(kEntryBits);
    for (int i = 2; i >= 0; --i) entry[i] = takeLast(kRootBits) - kRootBias;
    openvdb::Coord origin;
    for (int i = 0; i < 3; ++i)
        origin[i] = ((entry[i] * (1 << kEntryBits) + in_entry[i]) * (1 << kNodeBits) + in_node[i])
            * TileAccumulator::kSize;
    return origin;
}

/// Scales of a box's placements; 0 if it has none.
struct Scales {
    float smallest = 0, largest = 0;
};

/// The scales of each box.
std::vector<Scales> scalesOf(const PlacedScene& scene, std::size_t boxes)
{
    std::vector<Scales> scales(boxes);
    for (const Placement& p : scene.boxes.placements) {
        Scales& s = scales[p.box];
        s.smallest = s.largest == 0 ? p.scale : std::min(s.smallest, p.scale);
        s.largest = std::max(s.largest, p.scale);
    }
    return scales;
}

/// Sets the factors of all levels, for placements for which an edge of 1 in the box is `smallest`
/// to `largest` voxels of the target.
void setBlocked(Pyramid& levels, double smallest, double largest)
{
    for (std::size_t n = 0; n < levels.size(); ++n) {
        // levelFor(): a level stands for steps of more than 1/2 up to 1, the first also for all
        // above, and the last for all below.
        const double edge = levels[n].voxel,
                     least = std::max(edge * smallest, n + 1 < levels.size() ? 0.5 : 0.0),
                     most = n > 0 ? std::min(edge * largest, 1.0) : edge * largest;
        if (least <= most) levels[n].blocked = BlockedFactors(levels[0], levels[n], least, most);
    }
}

} // namespace

BoxSources packBoxes(const std::vector<Box>& boxes, const PlacedScene& scene, double voxel,
                     Kept keep)
{
    const std::vector<Scales> scales = scalesOf(scene, boxes.size());
    BoxSources packed;
    packed.boxes.resize(boxes.size());
    const auto addMaterial = [&](const std::string& m) {
        if (std::find(packed.materials.begin(), packed.materials.end(), m)
            == packed.materials.end())
            packed.materials.push_back(m);
    };
    for (std::size_t b = 0; b < boxes.size(); ++b)
        if (scales[b].largest > 0)
            for (const VolumePart& part : boxes[b].volume.parts) {
                packed.boxes[b].push_back({packPart(part, boxes[b].name)});
                Pyramid& levels = packed.boxes[b].back();
                for (int n = levelFor(levels[0].voxel * scales[b].smallest / voxel);
                     n > 0 && levels.back().voxels.size() > 1; --n)
                    levels.push_back(coarsen(levels.back(), keep));
                addMaterial(part.material);
            }
    for (const Skin& skin : skinsOf(scene)) addMaterial(skin.material());
    return packed;
}

void findBlocked(const PlacedScene& scene, double voxel, BoxSources& packed)
{
    const std::vector<Scales> scales = scalesOf(scene, packed.boxes.size());
    for (std::size_t b = 0; b < packed.boxes.size(); ++b)
        for (Pyramid& levels : packed.boxes[b])
            setBlocked(levels, scales[b].smallest / voxel, scales[b].largest / voxel);
}

TileSources::TileSources(const std::vector<Pyramids>& boxes, const PlacedScene& scene,
                         const ComposeParams& params, std::string material)
    : m_boxes(boxes), m_scene(scene), m_placements(scene.boxes.placements), m_skins(skinsOf(scene)),
      m_params(params), m_material(std::move(material))
{
    findKind();
    findColours();
    findTiles();
}

PackedPart TileSources::emptyPart() const
{
    PackedPart part;
    part.material = m_material;
    part.kind = m_kind;
    part.has_direction = m_direction;
    part.has_colour = m_colour;
    part.has_scatter_ratio = m_scatter_ratio;
    part.has_own_share = m_own_share;
    if (!m_colour) part.uniform_colour = m_uniform;
    return part;
}

void TileSources::compose(std::size_t tile, TileAccumulator& sums, VoxelStore& store,
                          std::vector<PackedBlock>& blocks) const
{
    const std::size_t first = m_first[tile], end = m_first[tile + 1];
    const openvdb::Coord origin = tileOrigin(m_entries[first].tile);
    for (std::size_t i = first; i < end; ++i) {
        std::uint64_t source = m_entries[i].source;
        if (source < m_placements.size()) {
            const Placement& p = m_placements[source];
            // If directions are equally strong, the earlier placement's wins (MODEL section 8): it
            // counts for up to 1/4096 more, which is less than a half float shows.
            const float weight = 1 + float(end - i) / float(end - first) / 4096;
            const VoxelTint tint = tintOf(source);
            PlacedBox(p, *partOf(p), m_params.voxel)
                .add(origin, weight, tint.colour ? &tint : nullptr, sums);
            continue;
        }
        source -= m_placements.size();
        for (const Skin& skin : m_skins) {
            const std::size_t triangles = skin.surface().mesh().triangles.size();
            if (source < triangles) {
                skin.add(static_cast<std::int32_t>(source), m_params.voxel, origin, sums);
                break;
            }
            source -= triangles;
        }
    }
    const double minimum =
        std::max(m_params.minimum_density, m_params.minimum_depth / m_params.voxel);
    sums.finish(origin, static_cast<float>(minimum),
                {m_direction, m_colour, m_scatter_ratio, m_own_share}, store, blocks);
}

/// The part of this material at the level that the placement needs; null if the box has none.
const SourcePart* TileSources::partOf(const Placement& p) const
{
    for (const Pyramid& levels : m_boxes[p.box])
        if (levels[0].material == m_material) {
            if (levels[0].voxels.empty()) return nullptr;
            const int level = levelFor(levels[0].voxel * p.scale / m_params.voxel);
            return &levels[std::min<std::size_t>(level, levels.size() - 1)];
        }
    return nullptr;
}

bool TileSources::hasVoxelTint(const Placement& p) const
{
    return p.layer < m_scene.layers.size() && m_scene.layers[p.layer].tints_voxels;
}

/// The voxel tint of a placement; without a colour if it has none.
VoxelTint TileSources::tintOf(std::size_t placement) const
{
    const Placement& p = m_placements[placement];
    if (!hasVoxelTint(p)) return {};
    const PlacedLayer& layer = m_scene.layers[p.layer];
    return {&m_scene.surfaces[layer.surface].surface, &layer.tint,
            m_scene.boxes.triangle(placement)};
}

/// Finds the kind, on which all sources have to agree.
void TileSources::findKind()
{
    const SourcePart* first = nullptr;
    const auto differs = [&](const std::string& other) {
        return Error("compose: expected one kind of material '" + m_material + "', found that box '"
                     + first->box + "' and " + other
                     + " differ: one is a fibre, the other a surface. Bake the boxes again.");
    };
    for (const Placement& p : m_placements)
        if (const SourcePart* part = partOf(p)) {
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
void TileSources::findColours()
{
    std::optional<Vec3f> shared;
    const auto noteColour = [&](const Vec3f& c) {
        if (!shared) shared = c;
        else if (*shared != c) m_colour = true;
    };
    for (const Placement& p : m_placements)
        if (const SourcePart* part = partOf(p)) {
            m_direction = m_direction || part->has_direction;
            m_own_share = m_own_share || !part->squares.empty();
            m_scatter_ratio = m_scatter_ratio || !part->scatter_ratios.empty();
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

/// The tiles that the placements [begin, end) reach.
std::vector<TileSources::Entry> TileSources::placementEntries(std::size_t begin,
                                                              std::size_t end) const
{
    std::vector<Entry> entries;
    for (std::size_t i = begin; i < end; ++i)
        if (const SourcePart* part = partOf(m_placements[i]))
            PlacedBox(m_placements[i], *part, m_params.voxel)
                .forTiles([&](const openvdb::Coord& tile) {
                    entries.push_back({tileKey(tile), i});
                });
    return entries;
}

/// The tiles that the triangles of a skin reach, of which the first has the number `first_source`.
std::vector<TileSources::Entry> TileSources::skinEntries(const Skin& skin,
                                                         std::uint64_t first_source) const
{
    std::vector<Entry> entries;
    if (skin.material() != m_material) return entries;
    for (std::size_t t = 0; t < skin.surface().mesh().triangles.size(); ++t) {
        const openvdb::BBoxd bounds = skin.bounds(static_cast<std::int32_t>(t), m_params.voxel);
        forTilesBetween(bounds.min(), bounds.max(), "skin", [&](const openvdb::Coord& tile) {
            entries.push_back({tileKey(tile), first_source + t});
        });
    }
    return entries;
}

/// Lists the sources of every tile.
void TileSources::findTiles()
{
    constexpr std::size_t kChunk = 4096;
    const std::size_t count = m_placements.size(), chunks = (count + kChunk - 1) / kChunk;
    std::vector<std::vector<Entry>> lists(chunks);
    tbb::parallel_for(std::size_t(0), chunks, [&](std::size_t c) {
        lists[c] = placementEntries(c * kChunk, std::min(count, (c + 1) * kChunk));
    });
    std::uint64_t source = count;
    for (const Skin& skin : m_skins) {
        lists.push_back(skinEntries(skin, source));
        source += skin.surface().mesh().triangles.size();
    }
    std::size_t total = 0;
    for (const auto& list : lists) total += list.size();
    m_entries.reserve(total);
    for (auto& list : lists) {
        m_entries.insert(m_entries.end(), list.begin(), list.end());
        std::vector<Entry>().swap(list);
    }
    tbb::parallel_sort(m_entries.begin(), m_entries.end());
    for (std::size_t i = 0; i < m_entries.size(); ++i)
        if (i == 0 || m_entries[i].tile != m_entries[i - 1].tile) m_first.push_back(i);
    m_first.push_back(m_entries.size());
}

} // namespace volcomp
