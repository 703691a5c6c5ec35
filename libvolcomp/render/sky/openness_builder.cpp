// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/sky/openness_builder.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include <tbb/parallel_for.h>

#include "volcomp/base/interval.h"
#include "volcomp/render/skin/skin_tracer.h"
#include "volcomp/render/sky/neighbour_directions.h"

namespace volcomp {
namespace {

/// The optical depth that lets as much through as the columns of a leaf do in the mean, mean over
/// its three axes. It is less than that of the mean density where particles stand in clumps, as
/// leaves in crowns do.
double depthOfColumns(const float* density, int first, int edge, double extinction)
{
    float sums[3][kLeafDim * kLeafDim] = {};
    for (int x = 0; x < edge; ++x)
        for (int y = 0; y < edge; ++y)
            for (int z = 0; z < edge; ++z) {
                const float own = density[first + (x << 6 | y << 3 | z)];
                sums[0][y * edge + z] += own;
                sums[1][x * edge + z] += own;
                sums[2][x * edge + y] += own;
            }
    const int columns = edge * edge;
    double depth = 0;
    for (const auto& along : sums) {
        double passes = 0;
        for (int c = 0; c < columns; ++c) passes += std::exp(-extinction * double(along[c]));
        depth -= std::log(std::max(1e-30, passes / columns));
    }
    return depth / 3;
}

int floorDivide(int x, int y) { return x >= 0 ? x / y : -((y - 1 - x) / y); }

} // namespace

Openness::Builder::Builder(Openness& openness, const VoxelTree& tree, const Cells& cells,
                           double extinction, bool by_direction)
    : m_openness(openness), m_tree(tree), m_cells(cells), m_extinction(extinction),
      m_by_direction(by_direction)
{
}

void Openness::Builder::layCells(std::size_t most_cells)
{
    const openvdb::CoordBBox& box = m_cells.box;
    std::size_t cells = 0;
    for (m_width = m_cells.width;; m_width *= 2) {
        cells = 1;
        for (int a = 0; a < 3; ++a) {
            m_low[a] = floorDivide(box.min()[a], m_width);
            m_openness.m_size[a] = floorDivide(box.max()[a], m_width) - m_low[a] + 3;
            cells *= std::size_t(m_openness.m_size[a]);
        }
        if (cells <= most_cells || cells == 27) break; // one cell, and those around it
    }
    m_openness.m_cell_size = m_width * m_tree.voxelSize();
    const Vec3d first(m_low[0] - 0.5, m_low[1] - 0.5, m_low[2] - 0.5);
    m_openness.m_first = m_tree.origin() + m_openness.m_cell_size * m_tree.directionToWorld(first);
    m_lump_width = std::min(m_width, kLeafDim);
    m_lumps_across = kLeafDim / m_lump_width;
    m_lumps_of_leaf = m_lumps_across * m_lumps_across * m_lumps_across;
    m_openness.m_closed.resize(cells);
    if (m_by_direction) m_openness.m_passes.resize(cells);
}

std::size_t Openness::Builder::cellOf(const openvdb::Coord& origin) const
{
    int c[3];
    for (int a = 0; a < 3; ++a) c[a] = floorDivide(origin[a], m_width) - m_low[a] + 1;
    return m_openness.number(c[0], c[1], c[2]);
}

int Openness::Builder::lumpOf(int voxel) const
{
    const int x = (voxel >> 6) / m_lump_width, y = (voxel >> 3 & 7) / m_lump_width,
              z = (voxel & 7) / m_lump_width;
    return (x * m_lumps_across + y) * m_lumps_across + z;
}

int Openness::Builder::firstOf(int lump) const
{
    const int n = m_lumps_across;
    return numberInLeaf(lump / (n * n) * m_lump_width, lump / n % n * m_lump_width,
                        lump % n * m_lump_width);
}

template <class F>
void Openness::Builder::forEachLump(F&& f) const
{
    m_tree.forEachCell([&](const openvdb::Coord& origin, int leaf) {
        if (!m_cells.box.isInside(origin)) return;
        for (int k = 0; k < m_lumps_of_leaf; ++k)
            f(cellOf(origin + voxelInLeaf(firstOf(k))), origin,
              std::size_t(leaf) * std::size_t(m_lumps_of_leaf) + std::size_t(k));
    });
}

void Openness::Builder::addDensities()
{
    const std::size_t leaves = m_tree.leafCount();
    m_lumps.resize(leaves * std::size_t(m_lumps_of_leaf));
    tbb::parallel_for(std::size_t(0), leaves, [&](std::size_t i) {
        Lump* const lumps = &m_lumps[i * std::size_t(m_lumps_of_leaf)];
        float density[kLeafSize];
        m_tree.densities(int(i)).copyTo(density);
        for (int v = 0; v < kLeafSize; ++v) {
            Lump& lump = lumps[lumpOf(v)];
            lump.mass += density[v];
            lump.moment +=
                double(density[v]) * Vec3d((v >> 6) + 0.5, (v >> 3 & 7) + 0.5, (v & 7) + 0.5);
        }
        for (int k = 0; k < m_lumps_of_leaf; ++k)
            lumps[k].depth = depthOfColumns(density, firstOf(k), m_lump_width, m_extinction);
    });
    m_depth.assign(m_openness.cells(), 0);
    m_own_depth.assign(m_openness.cells(), 0);
    // A wider cell has several lumps in a row and several beside each other.
    const double width = m_width, beside = m_lump_width * m_lump_width / (width * width),
                 factor = m_extinction / (width * width);
    forEachLump([&](std::size_t cell, const openvdb::Coord&, std::size_t lump) {
        m_depth[cell] += float(beside * m_lumps[lump].depth);
        m_own_depth[cell] += float(factor * m_lumps[lump].mass);
    });
}

Vec3d Openness::Builder::middleOfMass(const Place* first, const Place* last) const
{
    double mass = 0;
    Vec3d moment(0.0);
    for (const Place* p = first; p != last; ++p) {
        const Lump& lump = m_lumps[p->lump];
        mass += lump.mass;
        moment += lump.moment + lump.mass * Vec3d(p->origin.x(), p->origin.y(), p->origin.z());
    }
    return m_tree.origin() + m_tree.voxelSize() * m_tree.directionToWorld(moment / mass);
}

void Openness::Builder::lookForSkins(const SkinTracer& skins)
{
    std::vector<Place> places;
    forEachLump([&](std::size_t cell, const openvdb::Coord& origin, std::size_t lump) {
        if (m_lumps[lump].mass > 0) places.push_back({cell, origin, lump});
    });
    // By place in a cell, as leaves may come in any order.
    std::sort(places.begin(), places.end(), [](const Place& a, const Place& b) {
        return std::tie(a.cell, a.origin, a.lump) < std::tie(b.cell, b.origin, b.lump);
    });
    m_visible.assign(m_openness.cells(), kAll);
    tbb::parallel_for(std::size_t(0), places.size(), [&](std::size_t i) {
        if (i > 0 && places[i - 1].cell == places[i].cell) return;
        std::size_t end = i;
        while (end < places.size() && places[end].cell == places[i].cell) ++end;
        const Vec3d from = middleOfMass(&places[i], places.data() + end);
        for (int d = 0; d < kDirections; ++d)
            if (skins.isOccluded(from, m_openness.m_directions[d], kInfinity))
                m_visible[places[i].cell] &= ~(std::uint32_t(1) << d);
    });
    giveToEmptyCells();
}

// Cells without mass see what most of their neighbours with mass see.
void Openness::Builder::giveToEmptyCells()
{
    const std::array<int, 3>& size = m_openness.m_size;
    const std::vector<std::uint32_t> known = m_visible;
    tbb::parallel_for(0, size[0], [&](int x) {
        for (int y = 0; y < size[1]; ++y)
            for (int z = 0; z < size[2]; ++z) {
                const std::size_t cell = m_openness.number(x, y, z);
                if (m_depth[cell] > 0) continue;
                int neighbours = 0, sees[kDirections] = {};
                for (int n = 0; n < kDirections; ++n) {
                    const NeighbourStep step = neighbourStep(n);
                    const int at[3] = {x + step[0], y + step[1], z + step[2]};
                    if (at[0] < 0 || at[0] >= size[0] || at[1] < 0 || at[1] >= size[1] || at[2] < 0
                        || at[2] >= size[2])
                        continue;
                    const std::size_t other = m_openness.number(at[0], at[1], at[2]);
                    if (!(m_depth[other] > 0)) continue;
                    ++neighbours;
                    for (int d = 0; d < kDirections; ++d) sees[d] += int(known[other] >> d & 1);
                }
                for (int d = 0; d < kDirections; ++d)
                    if (2 * sees[d] < neighbours) m_visible[cell] &= ~(std::uint32_t(1) << d);
            }
    });
}

void Openness::Builder::passAll()
{
    m_escapes.assign(m_openness.cells(), 0);
    for (int d = 0; d < kDirections; ++d) pass(d);
    for (std::size_t c = 0; c < m_openness.cells(); ++c) {
        const float closed = std::min(1.0F, std::max(0.0F, 1 - m_escapes[c]));
        m_openness.m_closed[c] = std::uint16_t(std::lround(65535 * closed));
        if (m_by_direction && !m_visible.empty()) m_openness.m_passes[c].visible = m_visible[c];
    }
}

void Openness::Builder::pass(int direction)
{
    const NeighbourStep step = neighbourStep(direction);
    m_weight = float(neighbourWeight(direction));
    if (step[0] != 0) passAcross(direction, step.data());
    else passInPlane(direction, step.data());
}

// A direction with a step along x: plane after plane, from the side that it looks to.
void Openness::Builder::passAcross(int direction, const int* step)
{
    const std::array<int, 3>& size = m_openness.m_size;
    // Rows have an end of 0 on both sides, and there are two empty ones.
    const std::size_t row = std::size_t(size[2]) + 2;
    std::vector<float> before(row * (size[1] + 2), 0), after(before);
    for (int i = 0; i < size[0]; ++i) {
        const int x = step[0] > 0 ? size[0] - 1 - i : i;
        tbb::parallel_for(0, size[1], [&](int y) {
            passRow(direction, m_openness.number(x, y, 0), &before[row * (y + 1 + step[1]) + 1],
                    &after[row * (y + 1) + 1]);
        });
        before.swap(after);
    }
}

// A direction in the plane of y and z: all planes at once.
void Openness::Builder::passInPlane(int direction, const int* step)
{
    const std::array<int, 3>& size = m_openness.m_size;
    tbb::parallel_for(0, size[0], [&](int x) {
        std::vector<float> before(std::size_t(size[2]) + 2, 0), after(before);
        for (int i = 0; i < size[1]; ++i) {
            const int y = step[1] > 0 ? size[1] - 1 - i : i;
            const std::size_t first = m_openness.number(x, y, 0);
            if (step[1] != 0) {
                passRow(direction, first, &before[1], &after[1]);
                before.swap(after);
                continue;
            }
            float sum = 0;
            for (int k = 0; k < size[2]; ++k) {
                const std::size_t cell = first + (step[2] > 0 ? size[2] - 1 - k : k);
                keep(direction, cell, sum + 0.5F * m_own_depth[cell]);
                sum += m_depth[cell];
            }
        }
    });
}

// One row of cells along z, from the sums of the row that the direction looks to.
void Openness::Builder::passRow(int direction, std::size_t first, const float* before, float* after)
{
    const NeighbourStep step = neighbourStep(direction);
    const float length = std::sqrt(float(neighbourAxes(step)));
    for (int z = 0; z < m_openness.m_size[2]; ++z) {
        const float outside = before[z + step[2]];
        keep(direction, first + z, outside + 0.5F * length * m_own_depth[first + z]);
        after[z] = outside + length * m_depth[first + z];
    }
}

void Openness::Builder::keep(int direction, std::size_t cell, float depth)
{
    constexpr float kDark = 20;
    const float passes = depth == 0 ? 1 : depth < kDark ? std::exp(-depth) : 0;
    if (m_by_direction)
        m_openness.m_passes[cell].volume[direction] = std::uint8_t(passes * 255 + 0.5F);
    if (m_visible.empty() || (m_visible[cell] >> direction & 1))
        m_escapes[cell] += m_weight * passes;
}

} // namespace volcomp
