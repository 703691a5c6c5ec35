// SPDX-License-Identifier: Apache-2.0
// How the rays of a light are pushed through one layer of leaves.
#include "volcomp/render/shadow/shadow_sweeper.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include <tbb/parallel_for.h>

namespace volcomp {
namespace {

constexpr int kLeafVoxels = kLeafDim * kLeafDim * kLeafDim;

/// The key of a far leaf in its layer.
std::uint64_t farKey(int b, int c)
{
    return std::uint64_t(std::uint32_t(b)) << 32 | std::uint32_t(c);
}

} // namespace

void ShadowSweep::Sweeper::push(int layer)
{
    double s = planeAt(layer);
    const double end = s + kLeafDim;
    if (m_lattice.fans) {
        if (end <= m_lattice.s0) return;
        s = std::max(s, m_lattice.s0);
    }
    std::vector<Cell> directed_cells;
    const std::vector<BundleAt> bundles = bundlesToPush(layer, directed_cells);
    if (m_effective.size() < directed_cells.size() * kLeafVoxels)
        m_effective.resize(directed_cells.size() * kLeafVoxels);
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, directed_cells.size(), 16), [&](const auto& range) {
            for (std::size_t i = range.begin(); i < range.end(); ++i)
                makeEffective(directed_cells[i], layer, &m_effective[i * kLeafVoxels]);
        });
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, bundles.size(), 8),
                      [&](const auto& range) {
                          for (std::size_t i = range.begin(); i < range.end(); ++i)
                              pushBundle(bundles[i], layer, s, end);
                      });
    for (const Cell& cell : directed_cells)
        if (!cell.far) m_effective_of[cell.leaf] = -1;
    m_far_leaves.clear();
}

// The bundles that cross a leaf of the layer, are not dark and are still asked for behind it.
// Numbers the leaves under them whose extinction depends on the direction, and adds them to
// `directed_cells`.
std::vector<ShadowSweep::Sweeper::BundleAt>
ShadowSweep::Sweeper::bundlesToPush(int layer, std::vector<Cell>& directed_cells)
{
    std::vector<BundleAt> bundles;
    for (const Cell& cell : m_cells[layer]) {
        bool lit = false;
        const Rectangle& r = cell.bundles;
        for (int b = std::max(r.low[0], m_all.low[0]); b <= std::min(r.high[0], m_all.high[0]); ++b)
            for (int c = std::max(r.low[1], m_all.low[1]); c <= std::min(r.high[1], m_all.high[1]);
                 ++c) {
                const std::size_t at = m_all.index(b, c);
                Bundle& bundle = m_bundles[at];
                if (bundle.dark || m_last[at] <= layer) continue;
                lit = true;
                if (bundle.pushed_layer == layer) continue;
                bundle.pushed_layer = layer;
                bundles.push_back({b, c});
            }
        if (lit && cell.far) {
            m_far_leaves.emplace(farKey(cell.b, cell.c), int(directed_cells.size()));
            directed_cells.push_back(cell);
        }
        if (lit && !cell.far && m_sweep.m_directed && m_tree.leaf(cell.leaf).directed
            && m_effective_of[cell.leaf] < 0) {
            m_effective_of[cell.leaf] = int(directed_cells.size());
            directed_cells.push_back(cell);
        }
    }
    return bundles;
}

// Writes a leaf's densities as they count on the way to the light. For a point light that is taken
// to be the same way in the whole leaf: the one from its middle.
void ShadowSweep::Sweeper::makeEffective(const Cell& cell, int layer, float* to) const
{
    Vec3d to_light = -m_light.direction;
    if (m_lattice.fans) {
        to_light[m_lattice.a] = m_lattice.sign * (m_lattice.s0 - planeAt(layer) - kLeafDim / 2);
        to_light[m_lattice.b] = m_lattice.origin[0] - cell.b - kLeafDim / 2;
        to_light[m_lattice.c] = m_lattice.origin[1] - cell.c - kLeafDim / 2;
        const double length = to_light.length();
        to_light = m_tree.directionToWorld(length > 0 ? to_light / length : Vec3d(1, 0, 0));
    }
    if (cell.far) {
        takeBeyond(originOf(cell, layer), to_light, to);
        return;
    }
    m_tree.densities(cell.leaf).copyTo(to);
    forEachVoxelOf(m_tree.leaf(cell.leaf).mask, [&](int n, std::size_t) {
        to[n] = float(to[n] * m_tree.directionFactor(cell.leaf, n, to_light));
    });
}

// The rays of a bundle, where they cross the plane at s, in corner coordinates.
RayBundle ShadowSweep::Sweeper::raysAt(const BundleAt& at, double s) const
{
    RayBundle rays;
    for (int i = 0; i < kSide; ++i) {
        const double u = double(at.b) * kBundle + i, v = double(at.c) * kBundle + i;
        rays.b_slope[i] = m_lattice.slopeOf(0, u);
        rays.c_slope[i] = m_lattice.slopeOf(1, v);
        rays.b[i] = m_lattice.at(0, u, s);
        rays.c[i] = m_lattice.at(1, v, s);
    }
    return rays;
}

ShadowSweep::Sweeper::LeafRange ShadowSweep::Sweeper::leavesUnder(const BundleAt& at, double s,
                                                                  double end) const
{
    LeafRange range;
    for (int axis = 0; axis < 2; ++axis) {
        const double u0 = double(axis == 0 ? at.b : at.c) * kBundle, u1 = u0 + kBundle;
        const auto [low, high] =
            std::minmax({m_lattice.at(axis, u0, s), m_lattice.at(axis, u1, s),
                         m_lattice.at(axis, u0, end), m_lattice.at(axis, u1, end)});
        range.low[axis] = floorDivide(int(std::floor(low)), kLeafDim);
        range.count[axis] = std::min(
            Strip::kMaxLeaves, floorDivide(int(std::floor(high)), kLeafDim) - range.low[axis] + 1);
    }
    return range;
}

// Takes one bundle from the plane at s to the one at `end`, the far side of the layer.
void ShadowSweep::Sweeper::pushBundle(const BundleAt& at, int layer, double s, double end)
{
    const LeafRange under = leavesUnder(at, s, end);
    float* densities = m_strips.local().data() + Strip::kMargin;
    if (!fill(layer, under, densities)) return;
    Bundle& bundle = m_bundles[m_all.index(at.b, at.c)];
    if (!bundle.sums) bundle.sums = std::make_unique<RaySums>();

    RayBundle rays = raysAt(at, s);
    for (int i = 0; i < kSide; ++i) {
        rays.b[i] -= under.low[0] * kLeafDim;
        rays.c[i] -= under.low[1] * kLeafDim;
    }
    const int first = int(std::floor(s - planeAt(layer) + 1e-9)); // slice, as the light comes
    const double first_way = planeAt(layer) + first + 1 - s;
    Strip strip;
    strip.row_stride = under.count[1] * kLeafDim;
    const int slice_stride = strip.row_stride * under.count[0] * kLeafDim;
    const bool up = m_lattice.sign > 0;
    strip.slice_stride = up ? slice_stride : -slice_stride;
    strip.first_slice = densities + (up ? first : kLeafDim - 1 - first) * slice_stride;
    bundle.least = pushRays(strip, kLeafDim - first, first_way, rays, *bundle.sums);
    // Rays are at least as long as the slices that they cross.
    bundle.dark = bundle.least * m_sweep.m_extinction > m_sweep.m_darkest;
    if (bundle.dark) bundle.sums.reset();
}

namespace {

/// Copies a leaf's densities into a strip across axis a: slices, rows along b, c fastest. Writes
/// zeros if `from` is null.
void copyLeaf(const float* from, int a, int row_stride, int slice_stride, float* to)
{
    const int slice_from = a == 0 ? 64 : a == 1 ? 8 : 1, b_from = a == 0 ? 8 : 64;
    for (int slice = 0; slice < kLeafDim; ++slice)
        for (int row = 0; row < kLeafDim; ++row) {
            float* at = to + slice * slice_stride + row * row_stride;
            if (!from) std::memset(at, 0, kLeafDim * sizeof(float));
            else if (a < 2)
                std::memcpy(at, from + slice * slice_from + row * b_from, kLeafDim * sizeof(float));
            else
                for (int n = 0; n < kLeafDim; ++n) at[n] = from[row * 64 + n * 8 + slice];
        }
}

} // namespace

// Copies the densities of some leaves into a strip. Returns false, with nothing copied, if no leaf
// is there.
bool ShadowSweep::Sweeper::fill(int layer, const LeafRange& range, float* strip) const
{
    const int a = m_lattice.a, b = m_lattice.b, c = m_lattice.c;
    int leaves[Strip::kMaxLeaves][Strip::kMaxLeaves];
    const float* far[Strip::kMaxLeaves][Strip::kMaxLeaves];
    bool any = false;
    openvdb::Coord cell;
    cell[a] = int(m_lattice.sign > 0 ? planeAt(layer) : -planeAt(layer + 1));
    for (int i = 0; i < range.count[0]; ++i)
        for (int j = 0; j < range.count[1]; ++j) {
            cell[b] = (range.low[0] + i) * kLeafDim;
            cell[c] = (range.low[1] + j) * kLeafDim;
            leaves[i][j] = VoxelTree::kEmpty;
            far[i][j] = nullptr;
            if (isFar(cell)) {
                const auto found = m_far_leaves.find(farKey(cell[b], cell[c]));
                if (found != m_far_leaves.end())
                    far[i][j] = &m_effective[std::size_t(found->second) * kLeafVoxels];
            } else leaves[i][j] = m_tree.leafAt(cell[0], cell[1], cell[2]);
            any |= leaves[i][j] != VoxelTree::kEmpty || far[i][j];
        }
    if (!any) return false;
    const int row_stride = range.count[1] * kLeafDim,
              slice_stride = row_stride * range.count[0] * kLeafDim;
    for (int i = 0; i < range.count[0]; ++i)
        for (int j = 0; j < range.count[1]; ++j) {
            const int leaf = leaves[i][j];
            const float* from = far[i][j];
            float densities[kLeafVoxels];
            if (leaf != VoxelTree::kEmpty && m_sweep.m_directed
                && std::size_t(leaf) < m_effective_of.size() && m_effective_of[leaf] >= 0)
                from = &m_effective[std::size_t(m_effective_of[leaf]) * kLeafVoxels];
            else if (leaf != VoxelTree::kEmpty) {
                m_tree.densities(leaf).copyTo(densities);
                from = densities;
            }
            copyLeaf(from, a, row_stride, slice_stride,
                     strip + i * kLeafDim * row_stride + j * kLeafDim);
        }
    return true;
}

} // namespace volcomp
