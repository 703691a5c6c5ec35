// SPDX-License-Identifier: Apache-2.0
#include "volcomp/bake/solid_fill.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include "volcomp/base/error.h"

namespace volcomp {
namespace {

constexpr int kLines = 4; ///< for each voxel and axis across
constexpr double kMostCrossings = 1e9;
constexpr double kMostInside = 1e8; ///< voxels
/// Lines lie a little beside the middles, so that none runs along the edges of what was modelled
/// on a grid.
constexpr double kBeside[2] = {0.5003173, 0.5001913};

/// A line along x enters or leaves at x.
struct Crossing {
    std::int32_t j, k; ///< its number along y and z
    std::int32_t turn; ///< +1 or -1
    double x;
    bool operator<(const Crossing& o) const
    {
        if (j != o.j) return j < o.j;
        if (k != o.k) return k < o.k;
        return x != o.x ? x < o.x : turn < o.turn;
    }
};

/// Which side of the edge from a to b the point is on, in the plane across x: the same number, but
/// for its sign, for both directions of the edge.
bool isLeft(const Vec3d& a, const Vec3d& b, double y, double z)
{
    const bool swap = std::pair(b[1], b[2]) < std::pair(a[1], a[2]);
    const Vec3d &from = swap ? b : a, &to = swap ? a : b;
    const double side = (to[1] - from[1]) * (z - from[2]) - (to[2] - from[2]) * (y - from[1]);
    return (side >= 0) != swap;
}

/// Calls f(crossing) for each line that the triangle crosses.
template <class F>
void forCrossings(const std::array<Vec3d, 3>& t, F&& f)
{
    const Vec3d n = (t[1] - t[0]).cross(t[2] - t[0]);
    if (n[0] == 0) return;
    const auto range = [&](int axis, double beside) {
        const auto [low, high] =
            std::minmax({t[0][axis] * kLines, t[1][axis] * kLines, t[2][axis] * kLines});
        return std::pair(static_cast<std::int32_t>(std::ceil(low - beside)),
                         static_cast<std::int32_t>(std::floor(high - beside)));
    };
    const auto [j0, j1] = range(1, kBeside[0]);
    const auto [k0, k1] = range(2, kBeside[1]);
    for (std::int32_t j = j0; j <= j1; ++j)
        for (std::int32_t k = k0; k <= k1; ++k) {
            const double y = (j + kBeside[0]) / kLines, z = (k + kBeside[1]) / kLines;
            const bool first = isLeft(t[0], t[1], y, z);
            if (isLeft(t[1], t[2], y, z) != first || isLeft(t[2], t[0], y, z) != first) continue;
            const double x = t[0][0] - (n[1] * (y - t[0][1]) + n[2] * (z - t[0][2])) / n[0];
            f(Crossing{j, k, first ? 1 : -1, x});
        }
}

std::vector<Crossing> findCrossings(const std::vector<std::array<Vec3d, 3>>& triangles)
{
    double expected = 0;
    for (const auto& t : triangles)
        expected += 0.5 * std::abs((t[1] - t[0]).cross(t[2] - t[0])[0]) * kLines * kLines;
    if (expected > kMostCrossings)
        throw Error(fmt::format("the voxel of a box: its bodies have a surface of about {:.2g} "
                                "voxels, more than {:.2g}; a larger voxel is needed",
                                expected / (kLines * kLines), kMostCrossings / (kLines * kLines)));
    constexpr std::size_t kChunk = 1024;
    std::vector<std::vector<Crossing>> found((triangles.size() + kChunk - 1) / kChunk);
    tbb::parallel_for(std::size_t(0), found.size(), [&](std::size_t chunk) {
        const std::size_t end = std::min(triangles.size(), (chunk + 1) * kChunk);
        for (std::size_t i = chunk * kChunk; i < end; ++i)
            forCrossings(triangles[i], [&](const Crossing& c) { found[chunk].push_back(c); });
    });
    std::vector<Crossing> all;
    for (std::vector<Crossing>& some : found) {
        all.insert(all.end(), some.begin(), some.end());
        some = {};
    }
    tbb::parallel_sort(all.begin(), all.end());
    return all;
}

/// Calls f(from, to) for each piece of a line that is inside.
template <class F>
void forInsides(const std::vector<Crossing>& crossings, F&& f)
{
    std::int64_t winding = 0;
    for (std::size_t i = 0; i + 1 < crossings.size(); ++i) {
        const Crossing &from = crossings[i], &to = crossings[i + 1];
        winding += from.turn;
        if (from.j != to.j || from.k != to.k) winding = 0;
        else if (winding != 0) f(from, to);
    }
}

} // namespace

openvdb::FloatGrid::Ptr fillSolids(const std::vector<std::array<Vec3d, 3>>& triangles)
{
    const std::vector<Crossing> crossings = findCrossings(triangles);
    openvdb::FloatGrid::Ptr grid = openvdb::FloatGrid::create(0.0f);
    openvdb::FloatGrid::Accessor values = grid->getAccessor();
    const auto voxelOf = [](std::int32_t line) {
        return line >= 0 ? line / kLines : -((kLines - 1 - line) / kLines);
    };
    double volume = 0;
    forInsides(crossings,
               [&](const Crossing& from, const Crossing& to) { volume += to.x - from.x; });
    if (volume > kMostInside * kLines * kLines)
        throw Error(
            fmt::format("the voxel of a box: its bodies have about {:.2g} voxels inside, more "
                        "than {:.2g}; a larger voxel, or solid = \"sheet\", is needed",
                        volume / (kLines * kLines), kMostInside));
    forInsides(crossings, [&](const Crossing& from, const Crossing& to) {
        openvdb::Coord at(0, voxelOf(from.j), voxelOf(from.k));
        for (auto x = static_cast<std::int32_t>(std::floor(from.x)); x < to.x; ++x) {
            const double length = std::min(to.x, x + 1.0) - std::max(from.x, double(x));
            at[0] = x;
            values.setValue(at, values.getValue(at) + float(length / (kLines * kLines)));
        }
    });
    return grid;
}

} // namespace volcomp
