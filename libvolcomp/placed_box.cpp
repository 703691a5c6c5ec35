#include "placed_box.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "error.h"

namespace volcomp {
namespace {

using Four = float __attribute__((vector_size(16)));

constexpr int kTile = TileAccumulator::kSize, kBatch = TileAccumulator::kBatch;
constexpr double kFarthest = double(1 << 24); ///< voxels from the origin
constexpr float kSnap = 4096;                 ///< positions are multiples of 1/4096 voxel, so that aligned boxes stay aligned

/// To the nearest multiple of 1/4096, for |x| < 1024; beyond it loses digits, and those voxels are not of the tile. Vectorises on any target.
float snapped(float x)
{
    constexpr float kShift = 1.5f * (1 << 23) / kSnap;
    return (x + kShift) - kShift;
}

Four four(const float (&v)[3]) { return Four{v[0], v[1], v[2], 0}; }

} // namespace

void forTilesBetween(const Vec3d& low, const Vec3d& high, const char* what, const std::function<void(const openvdb::Coord&)>& visit)
{
    openvdb::Coord from, to;
    for (int i = 0; i < 3; ++i) {
        if (!(low[i] > -kFarthest && high[i] < kFarthest))
            throw Error(fmt::format(
                "{}: expected voxels at most 2^24 from the origin, found {:g}; use a larger voxel or move the scene to its origin", what,
                std::max(std::abs(low[i]), std::abs(high[i]))));
        from[i] = static_cast<int>(std::floor(low[i] / kTile));
        to[i] = static_cast<int>(std::floor(high[i] / kTile));
    }
    for (int x = from[0]; x <= to[0]; ++x)
        for (int y = from[1]; y <= to[1]; ++y)
            for (int z = from[2]; z <= to[2]; ++z) visit(openvdb::Coord(x, y, z));
}

PlacedBox::PlacedBox(const Placement& p, const SourcePart& part, double voxel) : m_placement(p), m_part(part), m_voxel(voxel)
{
    const double step = part.voxel * p.scale / voxel;
    const Vec3f* axes[3] = {&p.x_axis, &p.y_axis, &p.z_axis};
    for (int a = 0; a < 3; ++a)
        for (int i = 0; i < 3; ++i) {
            m_turn[a][i] = (*axes[a])[i];
            m_axes[a][i] = static_cast<float>((*axes[a])[i] * step);
        }
    m_root = p.position / voxel + Vec3d(0.5);
    m_divisions = step <= 1.5 ? 1 : static_cast<int>(std::ceil(step));
    const double exact = step / m_divisions;
    m_width = std::max(1.0f, std::round(static_cast<float>(exact) * kSnap)) / kSnap;
    const double shrunk = exact / m_width; // what rounding the width took
    m_density = static_cast<float>(shrunk * shrunk * shrunk / p.scale);
}

Vec3d PlacedBox::mapped(const Vec3f& p) const
{
    Vec3d s(0.0);
    for (int a = 0; a < 3; ++a)
        for (int i = 0; i < 3; ++i) s[i] += double(m_axes[a][i]) * p[a];
    return s;
}

Vec3d PlacedBox::span(const Vec3f& half) const
{
    Vec3d s(0.0);
    for (int a = 0; a < 3; ++a)
        for (int i = 0; i < 3; ++i) s[i] += std::abs(double(m_axes[a][i])) * half[a];
    return s;
}

Vec3d PlacedBox::worldOf(const Vec3f& p) const { return m_placement.position + mapped(p) * m_voxel; }

void PlacedBox::forTiles(const std::function<void(const openvdb::Coord&)>& visit) const
{
    const double margin = 0.5 * m_width + 1e-3;
    const Vec3d centre = m_root + mapped(m_part.bounds.centre), half = span(m_part.bounds.half) + Vec3d(margin);
    // A tile that the bounds reach may still pass the turned box by: the tile's bounds along the box's axes say so.
    double reach[3];
    for (int a = 0; a < 3; ++a) {
        const double tile =
            0.5 * kTile * (std::abs(double(m_turn[a][0])) + std::abs(double(m_turn[a][1])) + std::abs(double(m_turn[a][2])));
        const double step = Vec3d(m_axes[a][0], m_axes[a][1], m_axes[a][2]).length();
        reach[a] = tile + step * m_part.bounds.half[a] + margin * 1.7321;
    }
    forTilesBetween(centre - half, centre + half, "placement", [&](const openvdb::Coord& tile) {
        const Vec3d d = Vec3d(tile[0] + 0.5, tile[1] + 0.5, tile[2] + 0.5) * double(kTile) - centre;
        for (int a = 0; a < 3; ++a)
            if (std::abs(d[0] * m_turn[a][0] + d[1] * m_turn[a][1] + d[2] * m_turn[a][2]) > reach[a]) return;
        visit(tile);
    });
}

/// What adding to one tile needs at every block.
struct PlacedBox::InTile {
    const PlacedBox& box;
    TileAccumulator& tile;
    TileAccumulator::Batch batch;
    float root[3];                  ///< in the tile's coordinates
    Four origin, axes[3], spans[3]; ///< for the bounds; spans are the axes' absolute values
    Four turn[3], tint;
    float directions; ///< factor of the sum of t tᵀ
    std::optional<TintWalk> walk;

    bool reaches(const SourceBounds& b) const
    {
        constexpr float kHalf = 0.5f * kTile;
        const Four centre = origin + b.centre[0] * axes[0] + b.centre[1] * axes[1] + b.centre[2] * axes[2];
        const float margin = 0.5f * box.m_width + 1e-3f + kHalf;
        const Four half = margin + b.half[0] * spans[0] + b.half[1] * spans[1] + b.half[2] * spans[2];
        const Four over = (centre - kHalf > 0 ? centre - kHalf : kHalf - centre) - half;
        return !((over[0] > 0) | (over[1] > 0) | (over[2] > 0));
    }

    /// The blocks of a group that reach the tile.
    void addGroup(std::size_t level, std::size_t index)
    {
        const SourcePart& part = box.m_part;
        const std::size_t count = level == 0 ? part.blocks.size() : part.groups[level - 1].size();
        for (std::size_t i = 8 * index; i < std::min(8 * index + 8, count); ++i) {
            if (level == 0) {
                if (reaches(part.blocks[i].bounds)) addBlock(part.blocks[i]);
            } else if (reaches(part.groups[level - 1][i])) addGroup(level - 1, i);
        }
    }

    void addBlock(const SourceBlock& block)
    {
        for (std::uint32_t begin = block.begin; begin < block.end; begin += kBatch)
            addVoxels(begin, static_cast<int>(std::min<std::uint32_t>(kBatch, block.end - begin)));
    }

    void addVoxels(std::uint32_t begin, int count)
    {
        const int divisions = box.m_divisions, parts = divisions * divisions * divisions;
        if (parts > 1)
            for (int k = 0; k < count; ++k) makeSum(begin, k);
        for (int part = 0; part < parts; ++part) {
            const int place[3] = {part / (divisions * divisions), part / divisions % divisions, part % divisions};
            const int n = findInside(begin, count, place);
            if (parts == 1)
                for (int k = 0; k < n; ++k) makeSum(begin, batch.index[k]);
            tile.add(batch, n, box.m_width);
        }
    }

    /// Sets the cubes' corners, for one part of divided voxels, and the index of those that reach into the tile.
    int findInside(std::uint32_t begin, int count, const int (&place)[3])
    {
        const float *x = &box.m_part.x[begin], *y = &box.m_part.y[begin], *z = &box.m_part.z[begin];
        float shift[3];
        for (int a = 0; a < 3; ++a) shift[a] = (float(place[a]) + 0.5f) / float(box.m_divisions) - 0.5f;
        std::int32_t inside[kBatch];
        for (int k = 0; k < count; ++k) inside[k] = 1;
        for (int i = 0; i < 3; ++i) {
            const float ax = box.m_axes[0][i], ay = box.m_axes[1][i], az = box.m_axes[2][i], width = box.m_width;
            const float from = root[i] + (shift[0] * ax + shift[1] * ay + shift[2] * az) - 0.5f * width;
            float* low = batch.low[i];
            for (int k = 0; k < count; ++k) {
                low[k] = snapped(from + (x[k] * ax + y[k] * ay + z[k] * az));
                inside[k] &= TileAccumulator::reaches(low[k], width);
            }
        }
        int n = 0;
        for (int k = 0; k < count; ++k) {
            batch.index[n] = k;
            n += inside[k];
        }
        return n;
    }

    void makeSum(std::uint32_t begin, int k)
    {
        const SourceVoxel& v = box.m_part.voxels[begin + k];
        const Four t = v.v[0] * turn[0] + v.v[1] * turn[1] + v.v[2] * turn[2];
        const Four next = {t[1], t[2], t[0], 0};
        Four diagonal = (t * t + v.iso) * directions;
        diagonal[3] = v.density * box.m_density;
        Four colour = Four{v.colour[0], v.colour[1], v.colour[2], 0} * tint;
        if (walk) {
            const Vec3f c = walk->at(box.worldOf({box.m_part.x[begin + k], box.m_part.y[begin + k], box.m_part.z[begin + k]}));
            colour *= Four{c[0], c[1], c[2], 0};
        }
        VoxelSum& sum = batch.sum[k];
        *reinterpret_cast<Four*>(sum.diagonal) = diagonal;
        *reinterpret_cast<Four*>(sum.mixed) = t * next * directions;
        *reinterpret_cast<Four*>(sum.colour) = colour;
    }
};

void PlacedBox::add(const openvdb::Coord& tile_origin, float weight, const VoxelTint* tint, TileAccumulator& tile) const
{
    if (m_part.blocks.empty()) return;
    InTile t{*this, tile, {}, {}, {}, {}, {}, {}, {}, m_density * weight, {}};
    for (int i = 0; i < 3; ++i) t.origin[i] = t.root[i] = static_cast<float>(m_root[i] - tile_origin[i]);
    for (int a = 0; a < 3; ++a) {
        t.axes[a] = four(m_axes[a]);
        t.turn[a] = four(m_turn[a]);
        t.spans[a] = t.axes[a] > 0 ? t.axes[a] : -t.axes[a];
        t.tint[a] = m_placement.tint[a] * m_density;
    }
    if (tint) t.walk.emplace(*tint, m_placement.triangle);
    t.addGroup(m_part.groups.size(), 0);
}

} // namespace volcomp
