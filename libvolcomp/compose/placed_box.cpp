// SPDX-License-Identifier: Apache-2.0
#include "volcomp/compose/placed_box.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <optional>
#include <vector>

#include <fmt/format.h>

#include "volcomp/base/error.h"

namespace volcomp {
namespace {

constexpr int kTile = TileAccumulator::kSize;
constexpr double kFarthest = double(1 << 24); ///< voxels from the origin

} // namespace

void forTilesBetween(const Vec3d& low, const Vec3d& high, const openvdb::CoordBBox* among,
                     const char* what, const std::function<void(const openvdb::Coord&)>& visit)
{
    openvdb::Coord from, to;
    for (int i = 0; i < 3; ++i) {
        if (!among && !(low[i] > -kFarthest && high[i] < kFarthest))
            throw Error(fmt::format(
                "{}: expected voxels at most 2^24 from the origin, found {:g}; use a larger voxel "
                "or move the scene to its origin",
                what, std::max(std::abs(low[i]), std::abs(high[i]))));
        double first = std::floor(low[i] / kTile), last = std::floor(high[i] / kTile);
        if (among) {
            first = std::max(first, double(among->min()[i]));
            last = std::min(last, double(among->max()[i]));
            if (!(first <= last)) return;
        }
        from[i] = static_cast<int>(first);
        to[i] = static_cast<int>(last);
    }
    for (int x = from[0]; x <= to[0]; ++x)
        for (int y = from[1]; y <= to[1]; ++y)
            for (int z = from[2]; z <= to[2]; ++z) visit(openvdb::Coord(x, y, z));
}

PlacedBox::PlacedBox(const Placement& p, const SourcePart& part, double voxel,
                     const BlockedFactors& blocked)
    : m_placement(p), m_part(part), m_voxel(voxel)
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
    const double shrunk = exact / m_width; // makes up for the rounding of the width
    const double kept = blocked.at(step);
    m_density = static_cast<float>(kept * shrunk * shrunk * shrunk / p.scale);
    // As many cubes of a strand as 1 / shrunk in each of its dimensions lie in a voxel. Their
    // densities are added, and so must be the squares.
    m_square = static_cast<float>(part.ownWeight() * kept * kept
                                  * std::pow(shrunk, 6 - part.dimension) / (p.scale * p.scale));
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

Vec3d PlacedBox::worldOf(const Vec3f& p) const
{
    return m_placement.position + mapped(p) * m_voxel;
}

void PlacedBox::forTiles(const openvdb::CoordBBox* among,
                         const std::function<void(const openvdb::Coord&)>& visit) const
{
    const double margin = 0.5 * m_width + 1e-3;
    const Vec3d centre = m_root + mapped(m_part.bounds.centre),
                half = span(m_part.bounds.half) + Vec3d(margin);
    // A tile that meets the bounds may still miss the turned box. Then their bounds along one of
    // the box's axes do not meet.
    double reach[3];
    for (int a = 0; a < 3; ++a) {
        const double tile = 0.5 * kTile
            * (std::abs(double(m_turn[a][0])) + std::abs(double(m_turn[a][1]))
               + std::abs(double(m_turn[a][2])));
        const double step = Vec3d(m_axes[a][0], m_axes[a][1], m_axes[a][2]).length();
        reach[a] = tile + step * m_part.bounds.half[a] + margin * 1.7321;
    }
    const auto visitIfReached = [&](const openvdb::Coord& tile) {
        const Vec3d d = Vec3d(tile[0] + 0.5, tile[1] + 0.5, tile[2] + 0.5) * double(kTile) - centre;
        for (int a = 0; a < 3; ++a)
            if (std::abs(d[0] * m_turn[a][0] + d[1] * m_turn[a][1] + d[2] * m_turn[a][2])
                > reach[a])
                return;
        visit(tile);
    };
    forTilesBetween(centre - half, centre + half, among, "placement", visitIfReached);
}

/// The tiles that bounds in voxels of the box reach.
openvdb::CoordBBox PlacedBox::tilesOf(const SourceBounds& bounds) const
{
    // Wider than in forTiles(), as positions are rounded.
    const Vec3d centre = m_root + mapped(bounds.centre),
                half = span(bounds.half) + Vec3d(0.5 * m_width + 1e-2);
    openvdb::Coord from, to;
    for (int i = 0; i < 3; ++i) {
        const auto tile = [](double voxel) {
            return static_cast<int>(std::floor(std::clamp(voxel, -1e9, 1e9) / kTile));
        };
        from[i] = tile(centre[i] - half[i]);
        to[i] = tile(centre[i] + half[i]);
    }
    return {from, to};
}

void PlacedBox::forGroups(
    const openvdb::CoordBBox& among,
    const std::function<bool(const openvdb::CoordBBox& tiles, bool last)>& visit) const
{
    struct Group {
        std::size_t list, number; ///< list 0: a voxel; n + 1: of SourcePart::bounds_of[n]
    };
    std::vector<Group> waiting;
    const auto push = [&](std::size_t list, std::size_t first) {
        constexpr std::size_t kTogether = BoundsList::kTogether;
        static_assert(kTogether == SourcePart::kRun);
        const std::size_t size =
            list == 0 ? m_part.voxels.size() : m_part.bounds_of[list - 1].size();
        for (std::size_t n = first; n < std::min(first + kTogether, size); ++n)
            waiting.push_back({list, n});
    };
    push(m_part.bounds_of.size(), 0);
    while (!waiting.empty()) {
        const Group group = waiting.back();
        waiting.pop_back();
        const SourceBounds bounds = boundsOf(group.list, group.number);
        if (bounds.half[0] < 0) continue; // it fills up the list
        openvdb::CoordBBox tiles = tilesOf(bounds);
        tiles.intersect(among);
        if (!tiles.empty() && visit(tiles, group.list == 0) && group.list > 0)
            push(group.list - 1, group.number * BoundsList::kTogether);
    }
}

/// One of the part's bounds, of the list before `list`; for list 0 the bounds of the middles of the
/// parts into which a voxel is divided.
SourceBounds PlacedBox::boundsOf(std::size_t list, std::size_t number) const
{
    if (list == 0)
        return {Vec3f(m_part.x[number], m_part.y[number], m_part.z[number]),
                Vec3f(0.5f - 0.5f / float(m_divisions))};
    const auto& values = m_part.bounds_of[list - 1].values;
    const auto at = [&](int first) {
        return Vec3f(values[first][number], values[first + 1][number], values[first + 2][number]);
    };
    return {at(0), at(3)};
}

BoxInTile PlacedBox::inTile(const openvdb::Coord& tile_origin, float weight) const
{
    BoxInTile t{};
    for (int i = 0; i < 3; ++i) t.root[i] = static_cast<float>(m_root[i] - tile_origin[i]);
    for (int a = 0; a < 3; ++a) {
        for (int i = 0; i < 3; ++i) {
            t.axes[a][i] = m_axes[a][i];
            t.turn[a][i] = m_turn[a][i];
            t.turn_next[a][i] = m_turn[a][(i + 1) % 3];
        }
        t.colour[a] = m_placement.tint[a] * m_density;
    }
    t.colour[3] = m_density;
    t.divisions = m_divisions;
    t.width = m_width;
    t.direction = m_density * weight;
    t.place[0] = m_part.x.data(), t.place[1] = m_part.y.data(), t.place[2] = m_part.z.data();
    t.voxels = m_part.voxels.data();
    t.squares = m_part.squares.empty() ? nullptr : m_part.squares.data();
    t.square = m_square;
    t.scatter_ratios = m_part.scatter_ratios.empty() ? nullptr : m_part.scatter_ratios.data();
    t.voxel_count = static_cast<std::uint32_t>(m_part.voxels.size());
    assert(m_part.bounds_of.size() <= BoxInTile::kMostLevels);
    for (const BoundsList& list : m_part.bounds_of) {
        for (int c = 0; c < 6; ++c) t.levels[t.level_count].values[c] = list.values[c].data();
        ++t.level_count;
    }
    return t;
}

void PlacedBox::add(const openvdb::Coord& tile_origin, float weight, const VoxelTint* tint,
                    TileAccumulator& tile) const
{
    if (m_part.voxels.empty()) return;
    BoxInTile box = inTile(tile_origin, weight);
    std::optional<BoxTint> box_tint;
    if (tint) box.tint = &box_tint.emplace(*this, *tint);
    addBox(box, tile);
}

BoxTint::BoxTint(const PlacedBox& box, const VoxelTint& tint) : m_box(box), m_walk(tint) { }

void BoxTint::apply(std::uint32_t voxel, VoxelSum& sum)
{
    const SourcePart& part = m_box.m_part;
    const Vec3f c = m_walk.at(m_box.worldOf({part.x[voxel], part.y[voxel], part.z[voxel]}));
    for (int i = 0; i < 3; ++i) sum.values[VoxelSum::kColour + i] *= c[i];
}

} // namespace volcomp
