#include "compose.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <optional>

#include <fmt/format.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include "box_source.h"
#include "error.h"
#include "tile_accumulator.h"

namespace volcomp {
namespace {

constexpr int kTile = TileAccumulator::kSize;
constexpr double kFarthest = double(1 << 25); ///< voxels from the origin
constexpr float kSnap = 4096;                 ///< positions are multiples of 1/4096 voxel, so that aligned boxes stay aligned

/// One part of a box at its own voxel, twice that, and so on as far as placements need it.
using Pyramid = std::vector<SourcePart>;
using Pyramids = std::vector<Pyramid>; ///< one for each material of a box

/// Level of the pyramid for a box placed so that its voxel is `step` voxels of the target: the coarsest whose voxel is not larger than the target's.
int levelFor(double step)
{
    int level = 0;
    for (; level < 24 && step <= 0.5; step *= 2) ++level;
    return level;
}

/// What a placement does to one part of its box, in voxels of the target.
struct Placed {
    float axes[3][3];    ///< voxels of the target for a voxel of the box along its x, y, z
    float turn[3][3];    ///< the same, unit length
    Vec3d origin;        ///< the root, with voxel (0,0,0)'s corner as the origin
    float width;         ///< edge of the cube that is added for each voxel (or each part of it, where it is divided)
    int divisions;       ///< along an edge
    float density;       ///< factor from the box's density to the density added where the cube covers a voxel fully
};

Placed place(const Placement& p, const SourcePart& part, double voxel)
{
    Placed q;
    const double step = part.voxel * p.scale / voxel;
    const Vec3f* axes[3] = {&p.x_axis, &p.y_axis, &p.z_axis};
    for (int a = 0; a < 3; ++a)
        for (int i = 0; i < 3; ++i) {
            q.turn[a][i] = (*axes[a])[i];
            q.axes[a][i] = static_cast<float>((*axes[a])[i] * step);
        }
    q.origin = p.position / voxel + Vec3d(0.5);
    q.divisions = step <= 1.5 ? 1 : static_cast<int>(std::ceil(step));
    const double exact = step / q.divisions;
    q.width = std::max(1.0f, std::round(static_cast<float>(exact) * kSnap)) / kSnap;
    const double shrunk = exact / q.width; // what rounding the width took
    q.density = static_cast<float>(shrunk * shrunk * shrunk / p.scale);
    return q;
}

/// A source of one tile: a placement, or behind them a skin's triangle.
struct Entry {
    std::uint64_t tile;
    std::uint64_t source;
    bool operator<(const Entry& other) const { return tile != other.tile ? tile < other.tile : source < other.source; }
};

std::uint64_t tileKey(const openvdb::Coord& t) ///< of tile coordinates; neighbours in z are neighbours in the order
{
    constexpr std::uint64_t kHalf = 1 << 20;
    return (std::uint64_t(t[0]) + kHalf) << 42 | (std::uint64_t(t[1]) + kHalf) << 21 | (std::uint64_t(t[2]) + kHalf);
}

openvdb::Coord tileOrigin(std::uint64_t key)
{
    constexpr int kHalf = 1 << 20, kMask = (1 << 21) - 1;
    return {(int(key >> 42 & kMask) - kHalf) * kTile, (int(key >> 21 & kMask) - kHalf) * kTile, (int(key & kMask) - kHalf) * kTile};
}

/// Half extents along the target's axes of a box given along the source's.
Vec3d spanOf(const float (&axes)[3][3], const Vec3f& half)
{
    Vec3d s(0.0);
    for (int a = 0; a < 3; ++a)
        for (int i = 0; i < 3; ++i) s[i] += std::abs(double(axes[a][i])) * half[a];
    return s;
}

Vec3d mapped(const float (&axes)[3][3], const Vec3f& p)
{
    Vec3d s(0.0);
    for (int a = 0; a < 3; ++a)
        for (int i = 0; i < 3; ++i) s[i] += double(axes[a][i]) * p[a];
    return s;
}

template <class Visit>
void forTiles(const Vec3d& low, const Vec3d& high, const std::string& what, const Visit& visit)
{
    openvdb::Coord from, to;
    for (int i = 0; i < 3; ++i) {
        if (!(low[i] > -kFarthest && high[i] < kFarthest))
            throw Error(what + fmt::format(": expected voxels at most 2^25 from the origin, found {:g}; use a larger voxel or move the scene to its origin",
                                           std::max(std::abs(low[i]), std::abs(high[i]))));
        from[i] = static_cast<int>(std::floor(low[i] / kTile));
        to[i] = static_cast<int>(std::floor(high[i] / kTile));
    }
    for (int x = from[0]; x <= to[0]; ++x)
        for (int y = from[1]; y <= to[1]; ++y)
            for (int z = from[2]; z <= to[2]; ++z) visit(openvdb::Coord(x, y, z));
}

/// The sources of one material.
class Composer {
public:
    Composer(const std::vector<Pyramids>& boxes, const std::vector<Placement>& placements, const ComposeExtras& extras,
             const ComposeParams& params, std::string material)
        : m_boxes(boxes), m_placements(placements), m_extras(extras), m_params(params), m_material(std::move(material))
    {
    }

    VolumePart run(const std::function<void(double)>& progress)
    {
        findColours();
        const std::vector<Entry> entries = bin();
        std::vector<std::size_t> first; // of each tile
        for (std::size_t i = 0; i < entries.size(); ++i)
            if (i == 0 || entries[i].tile != entries[i - 1].tile) first.push_back(i);
        first.push_back(entries.size());

        std::vector<std::vector<TileAccumulator::Leaves>> leaves(first.size() - 1);
        tbb::enumerable_thread_specific<TileAccumulator> accumulators;
        std::atomic<std::size_t> done{0};
        std::mutex mutex;
        tbb::parallel_for(std::size_t(0), leaves.size(), [&](std::size_t t) {
            TileAccumulator& tile = accumulators.local();
            const openvdb::Coord origin = tileOrigin(entries[first[t]].tile);
            for (std::size_t i = first[t]; i < first[t + 1]; ++i) add(entries[i].source, origin, tile);
            leaves[t] = tile.finish(origin, static_cast<float>(m_params.minimum_density), m_direction, m_colour);
            const std::size_t now = ++done;
            if (now % 64 == 0 && mutex.try_lock()) {
                progress(double(done) / double(leaves.size()));
                mutex.unlock();
            }
        });
        return gather(leaves);
    }

    /// Composes some tiles, spread evenly over all of them, and counts.
    void estimate(std::size_t most_tiles, ComposeEstimate& e)
    {
        findColours();
        const std::vector<Entry> entries = bin();
        std::vector<std::size_t> first;
        for (std::size_t i = 0; i < entries.size(); ++i)
            if (i == 0 || entries[i].tile != entries[i - 1].tile) first.push_back(i);
        const std::size_t tiles = first.size(), sample = std::min(tiles, most_tiles);
        if (tiles == 0) return;
        first.push_back(entries.size());
        std::size_t voxels = 0, leaves = 0;
        TileAccumulator tile;
        for (std::size_t k = 0; k < sample; ++k) {
            const std::size_t t = (2 * k + 1) * tiles / (2 * sample);
            const openvdb::Coord origin = tileOrigin(entries[first[t]].tile);
            for (std::size_t i = first[t]; i < first[t + 1]; ++i) add(entries[i].source, origin, tile);
            for (const TileAccumulator::Leaves& l : tile.finish(origin, static_cast<float>(m_params.minimum_density), false, false)) {
                voxels += l.density->onVoxelCount();
                ++leaves;
                delete l.density;
            }
        }
        const double factor = double(tiles) / double(sample);
        constexpr double kLeafOverhead = 128; // node, mask and the allocator's part
        e.voxels += double(voxels) * factor;
        e.bytes += double(leaves) * factor * (512 * 4 + kLeafOverhead + (m_direction ? 512 * 12 + kLeafOverhead : 0) + (m_colour ? 512 * 12 + kLeafOverhead : 0));
        e.bytes += double(entries.size()) * 2 * sizeof(Entry);
    }

private:
    const SourcePart* partOf(const Placement& p) const
    {
        for (const Pyramid& levels : m_boxes[p.box])
            if (levels[0].material == m_material) {
                if (levels[0].voxels.empty()) return nullptr;
                const int level = levelFor(levels[0].voxel * p.scale / m_params.voxel);
                return &levels[std::min<std::size_t>(level, levels.size() - 1)];
            }
        return nullptr;
    }

    /// Whether grids of direction and colour are needed, and where not, the one colour.
    void findColours()
    {
        std::optional<Vec3f> shared;
        const auto see = [&](const Vec3f& c) {
            if (!shared) shared = c;
            else if (*shared != c) m_colour = true;
        };
        for (const Placement& p : m_placements)
            if (const SourcePart* part = partOf(p)) {
                m_direction = m_direction || part->has_direction;
                m_kind = part->kind;
                if (part->has_colour || tintOf(p)) m_colour = true;
                else see(Vec3f(part->colour[0] * p.tint[0], part->colour[1] * p.tint[1], part->colour[2] * p.tint[2]));
            }
        for (const Skin& skin : m_extras.skins)
            if (skin.material() == m_material) {
                m_direction = true;
                m_kind = MaterialKind::surface;
                if (skin.hasColour()) m_colour = true;
                else see(skin.colour({}));
            }
        m_uniform = shared.value_or(Vec3f(1.0f));
    }

    const VoxelTint* tintOf(const Placement& p) const
    {
        if (p.layer < 0 || static_cast<std::size_t>(p.layer) >= m_extras.tints.size()) return nullptr;
        const VoxelTint& t = m_extras.tints[p.layer];
        return t.surface && t.colour ? &t : nullptr;
    }

    std::vector<Entry> bin() const
    {
        constexpr std::size_t kChunk = 4096;
        const std::size_t chunks = (m_placements.size() + kChunk - 1) / kChunk;
        std::vector<std::vector<Entry>> lists(chunks);
        tbb::parallel_for(std::size_t(0), chunks, [&](std::size_t c) {
            for (std::size_t i = c * kChunk; i < std::min(m_placements.size(), (c + 1) * kChunk); ++i) binPlacement(i, lists[c]);
        });
        std::uint64_t source = m_placements.size();
        std::vector<Entry> entries;
        std::size_t total = 0;
        for (const auto& list : lists) total += list.size();
        entries.reserve(total);
        for (auto& list : lists) {
            entries.insert(entries.end(), list.begin(), list.end());
            std::vector<Entry>().swap(list);
        }
        for (const Skin& skin : m_extras.skins) {
            const std::size_t triangles = skin.surface().mesh().triangles.size();
            if (skin.material() == m_material)
                for (std::size_t t = 0; t < triangles; ++t) {
                    Vec3d low, high;
                    skin.bounds(static_cast<std::int32_t>(t), m_params.voxel, low, high);
                    forTiles(low, high, "skin", [&](const openvdb::Coord& tile) { entries.push_back({tileKey(tile), source + t}); });
                }
            source += triangles;
        }
        tbb::parallel_sort(entries.begin(), entries.end());
        return entries;
    }

    void binPlacement(std::size_t index, std::vector<Entry>& list) const
    {
        const Placement& p = m_placements[index];
        const SourcePart* part = partOf(p);
        if (!part) return;
        const Placed q = place(p, *part, m_params.voxel);
        const double margin = 0.5 * q.width + 1e-3;
        const Vec3d centre = q.origin + mapped(q.axes, part->centre), half = spanOf(q.axes, part->half) + Vec3d(margin);
        // A tile that the bounds reach may still pass the turned box by: the tile's bounds along the box's axes say so.
        double edge[3], reach[3];
        for (int a = 0; a < 3; ++a) {
            edge[a] = 0.5 * kTile * (std::abs(double(q.turn[a][0])) + std::abs(double(q.turn[a][1])) + std::abs(double(q.turn[a][2])));
            const double step = Vec3d(q.axes[a][0], q.axes[a][1], q.axes[a][2]).length();
            reach[a] = edge[a] + step * part->half[a] + margin * 1.7321;
        }
        forTiles(centre - half, centre + half, "placement", [&](const openvdb::Coord& tile) {
            const Vec3d d = Vec3d(tile[0] + 0.5, tile[1] + 0.5, tile[2] + 0.5) * double(kTile) - centre;
            for (int a = 0; a < 3; ++a)
                if (std::abs(d[0] * q.turn[a][0] + d[1] * q.turn[a][1] + d[2] * q.turn[a][2]) > reach[a]) return;
            list.push_back({tileKey(tile), index});
        });
    }

    void add(std::uint64_t source, const openvdb::Coord& origin, TileAccumulator& tile) const
    {
        if (source < m_placements.size()) {
            const Placement& p = m_placements[source];
            addBox(p, *partOf(p), origin, tile);
            return;
        }
        source -= m_placements.size();
        for (const Skin& skin : m_extras.skins) {
            const std::size_t triangles = skin.surface().mesh().triangles.size();
            if (source < triangles) {
                skin.add(static_cast<std::int32_t>(source), m_params.voxel, origin, tile);
                return;
            }
            source -= triangles;
        }
    }

    void addBox(const Placement& p, const SourcePart& part, const openvdb::Coord& tile_origin, TileAccumulator& tile) const
    {
        const Placed q = place(p, part, m_params.voxel);
        const Vec3d origin = q.origin - Vec3d(tile_origin[0], tile_origin[1], tile_origin[2]);
        const float o[3] = {float(origin[0]), float(origin[1]), float(origin[2])};
        const VoxelTint* tint = tintOf(p);
        Surface::Walk walk;
        for (const SourceBlock& block : part.blocks) {
            const Vec3d centre = origin + mapped(q.axes, block.centre), half = spanOf(q.axes, block.half) + Vec3d(0.5 * q.width + 1e-3);
            bool outside = false;
            for (int i = 0; i < 3; ++i) outside = outside || centre[i] + half[i] < 0 || centre[i] - half[i] > kTile;
            if (outside) continue;
            const BlockUv uv = tint ? uvAround(*tint, worldOf(p, q, block.centre), half.length() * m_params.voxel, walk) : BlockUv{};
            for (std::uint32_t k = block.begin; k < block.end; ++k) {
                const SourceVoxel& v = part.voxels[k];
                VoxelSum sum;
                sum.density = v.density * q.density;
                float t[3];
                for (int i = 0; i < 3; ++i) t[i] = v.v[0] * q.turn[0][i] + v.v[1] * q.turn[1][i] + v.v[2] * q.turn[2][i];
                const float iso = v.iso * q.density;
                const float tensor[6] = {t[0] * t[0], t[1] * t[1], t[2] * t[2], t[0] * t[1], t[0] * t[2], t[1] * t[2]};
                for (int i = 0; i < 6; ++i) sum.tensor[i] = tensor[i] * q.density + (i < 3 ? iso : 0);
                for (int i = 0; i < 3; ++i) sum.colour[i] = v.colour[i] * p.tint[i] * q.density;
                if (tint) {
                    const Vec3f c = tintAt(*tint, uv, worldOf(p, q, {v.x, v.y, v.z}), walk);
                    for (int i = 0; i < 3; ++i) sum.colour[i] *= c[i];
                }
                if (q.divisions == 1) addVoxel(q, o, v.x, v.y, v.z, sum, tile);
                else
                    for (int x = 0; x < q.divisions; ++x)
                        for (int y = 0; y < q.divisions; ++y)
                            for (int z = 0; z < q.divisions; ++z) {
                                const auto part_of = [&](int n) { return (float(n) + 0.5f) / float(q.divisions) - 0.5f; };
                                addVoxel(q, o, v.x + part_of(x), v.y + part_of(y), v.z + part_of(z), sum, tile);
                            }
            }
        }
    }

    Vec3d worldOf(const Placement& p, const Placed& q, const Vec3f& voxel) const { return p.position + mapped(q.axes, voxel) * m_params.voxel; }

    static void addVoxel(const Placed& q, const float (&o)[3], float x, float y, float z, const VoxelSum& sum, TileAccumulator& tile)
    {
        float low[3];
        for (int i = 0; i < 3; ++i) {
            const float p = o[i] + (x * q.axes[0][i] + y * q.axes[1][i] + z * q.axes[2][i]) - 0.5f * q.width;
            low[i] = std::floor(p * kSnap + 0.5f) * (1 / kSnap);
        }
        tile.add(low, q.width, sum);
    }

    /// Where a block's voxels find their (u,v): linear around the surface's point nearest to the block's middle, or, where a seam or a border of the texture
    /// coordinates is near, at each voxel's own place.
    struct BlockUv {
        Vec2d uv{0.0, 0.0};
        Vec3d centre{0.0}, du{0.0}, dv{0.0};
        bool each = false;
    };

    BlockUv uvAround(const VoxelTint& tint, const Vec3d& centre, double radius, Surface::Walk& walk) const
    {
        BlockUv b;
        if (!tint.colour->usesUv() || tint.surface->projection().kind != ProjectionKind::uv) return b;
        const SurfacePoint s = tint.surface->nearest(centre, walk);
        const Surface::UvGradient g = tint.surface->uvGradient(s.triangle);
        b.centre = centre;
        b.uv = s.uv;
        b.du = g.du;
        b.dv = g.dv;
        b.each = tint.surface->seamDistance(s.triangle) < radius;
        return b;
    }

    Vec3f tintAt(const VoxelTint& tint, const BlockUv& b, const Vec3d& world, Surface::Walk& walk) const
    {
        if (!tint.colour->usesUv()) return tint.colour->colour({0.0, 0.0}, world);
        if (tint.surface->projection().kind != ProjectionKind::uv) return tint.colour->colour(tint.surface->projection().project(world), world);
        if (b.each) { // most voxels of a block stand on the triangle of the one before
            Vec2d uv;
            if (walk.triangle < 0 || !tint.surface->uvBelow(walk.triangle, world, uv)) uv = tint.surface->nearest(world, walk).uv;
            return tint.colour->colour(uv, world);
        }
        const Vec3d d = world - b.centre;
        return tint.colour->colour(b.uv + Vec2d(b.du.dot(d), b.dv.dot(d)), world);
    }

    VolumePart gather(std::vector<std::vector<TileAccumulator::Leaves>>& tiles) const
    {
        VolumePart part;
        part.material = m_material;
        part.kind = m_kind;
        const auto transform = openvdb::math::Transform::createLinearTransform(m_params.voxel);
        part.density = openvdb::FloatGrid::create(0.0f);
        part.density->setTransform(transform);
        part.density->setGridClass(openvdb::GRID_FOG_VOLUME);
        if (m_direction) {
            part.direction = openvdb::Vec3SGrid::create(openvdb::Vec3s(0.0f));
            part.direction->setTransform(transform);
        }
        if (m_colour) {
            part.colour = openvdb::Vec3SGrid::create(openvdb::Vec3s(0.0f));
            part.colour->setTransform(transform);
        } else part.uniform_colour = m_uniform;
        auto density = part.density->getAccessor();
        std::optional<openvdb::Vec3SGrid::Accessor> direction, colour;
        if (m_direction) direction.emplace(part.direction->getAccessor());
        if (m_colour) colour.emplace(part.colour->getAccessor());
        for (auto& tile : tiles)
            for (const TileAccumulator::Leaves& l : tile) {
                density.addLeaf(l.density);
                if (direction) direction->addLeaf(l.direction);
                if (colour) colour->addLeaf(l.colour);
            }
        return part;
    }

    const std::vector<Pyramids>& m_boxes;
    const std::vector<Placement>& m_placements;
    const ComposeExtras& m_extras;
    const ComposeParams& m_params;
    std::string m_material;
    MaterialKind m_kind = MaterialKind::fibre;
    bool m_direction = false, m_colour = false;
    Vec3f m_uniform{1.0f};
};

void check(const std::vector<Box>& boxes, const std::vector<Placement>& placements, const ComposeParams& params)
{
    params.validate();
    if (!(params.voxel > 0)) throw Error("compose: expected a voxel size > 0");
    for (const Placement& p : placements) {
        if (p.box < 0 || static_cast<std::size_t>(p.box) >= boxes.size())
            throw Error(fmt::format("compose: expected a box from 0 to {}, found {}", boxes.size() - 1, p.box));
        if (!(p.scale > 0 && std::isfinite(p.scale) && std::isfinite(p.position.lengthSqr()) && std::isfinite(p.tint.lengthSqr())))
            throw Error("compose: expected placements with finite positions and tints and a scale > 0");
        for (const Vec3f* axis : {&p.x_axis, &p.y_axis, &p.z_axis})
            if (!(std::abs(axis->lengthSqr() - 1) < 1e-3f)) throw Error("compose: expected placements with axes of unit length");
    }
}

} // namespace

Volume compose(const std::vector<Box>& boxes, const std::vector<Placement>& placements, const ComposeParams& params, const Progress& progress)
{
    return compose(boxes, placements, ComposeExtras{}, params, progress);
}

namespace {

/// Boxes packed for a voxel size, and the materials in the order in which they appear.
struct Packed {
    std::vector<Pyramids> sources;
    std::vector<std::string> materials;
};

Packed pack(const std::vector<Box>& boxes, const std::vector<Placement>& placements, const ComposeExtras& extras, double voxel)
{
    std::vector<float> smallest(boxes.size(), 0); // scale of the box's placements; 0: none
    for (const Placement& p : placements)
        if (smallest[p.box] == 0 || p.scale < smallest[p.box]) smallest[p.box] = p.scale;
    Packed packed;
    packed.sources.resize(boxes.size());
    const auto use = [&](const std::string& m) {
        if (std::find(packed.materials.begin(), packed.materials.end(), m) == packed.materials.end()) packed.materials.push_back(m);
    };
    for (std::size_t b = 0; b < boxes.size(); ++b)
        if (smallest[b] > 0)
            for (const VolumePart& part : boxes[b].volume.parts) {
                packed.sources[b].push_back({packPart(part, boxes[b].name)});
                Pyramid& levels = packed.sources[b].back();
                for (int n = levelFor(levels[0].voxel * smallest[b] / voxel); n > 0 && levels.back().voxels.size() > 1; --n)
                    levels.push_back(coarsen(levels.back()));
                use(part.material);
            }
    for (const Skin& skin : extras.skins) use(skin.material());
    return packed;
}

/// About how many pairs of a tile and a placement or triangle there are.
double pairsOf(const std::vector<Box>& boxes, const std::vector<Placement>& placements, const ComposeExtras& extras, double voxel)
{
    std::vector<Vec3d> extents;
    for (const Box& box : boxes) {
        double longest = 0;
        for (const VolumePart& part : box.volume.parts) {
            const openvdb::CoordBBox bounds = part.density->evalActiveVoxelBoundingBox();
            if (!bounds.empty()) longest = std::max(longest, bounds.dim().asVec3d().length() * part.density->voxelSize()[0]);
        }
        extents.emplace_back(longest);
    }
    const double tile = voxel * kTile;
    double pairs = 0;
    for (const Placement& p : placements) pairs += std::pow(extents[p.box][0] * p.scale / tile + 1, 3);
    for (const Skin& skin : extras.skins) pairs += double(skin.surface().mesh().triangles.size()) + skin.surface().area() / (tile * tile);
    return pairs;
}

} // namespace

ComposeEstimate estimateCompose(const std::vector<Box>& boxes, const std::vector<Placement>& placements, const ComposeExtras& extras,
                                const ComposeParams& params)
{
    check(boxes, placements, params);
    ComposeParams coarse = params;
    double factor = 1; // finer than the boxes, voxels grow with the cube of the resolution
    while (pairsOf(boxes, placements, extras, coarse.voxel) > 2e7 && coarse.voxel < 1e30) {
        coarse.voxel *= 2;
        factor *= 8;
    }
    const Packed packed = pack(boxes, placements, extras, coarse.voxel);
    ComposeEstimate e;
    for (const std::string& material : packed.materials) Composer(packed.sources, placements, extras, coarse, material).estimate(48, e);
    e.voxels *= factor;
    e.bytes *= factor;
    e.bytes += double(placements.size()) * sizeof(Placement);
    return e;
}

Volume compose(const std::vector<Box>& boxes, const std::vector<Placement>& placements, const ComposeExtras& extras, const ComposeParams& params,
               const Progress& progress)
{
    check(boxes, placements, params);
    const Packed packed = pack(boxes, placements, extras, params.voxel);
    const std::vector<std::string>& materials = packed.materials;
    Volume volume;
    for (std::size_t m = 0; m < materials.size(); ++m)
        volume.parts.push_back(Composer(packed.sources, placements, extras, params, materials[m]).run([&](double f) {
            report(progress, (double(m) + f) / double(materials.size()));
        }));
    if (volume.parts.empty()) {
        const std::vector<Placement> none;
        const ComposeExtras no_extras;
        volume.parts.push_back(Composer(packed.sources, none, no_extras, params, "").run([](double) {}));
    }
    report(progress, 1);
    return volume;
}

} // namespace volcomp
