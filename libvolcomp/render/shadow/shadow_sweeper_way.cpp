// SPDX-License-Identifier: Apache-2.0
// What a tree that is made on the way has to make before light is swept through it.
#include "volcomp/render/shadow/shadow_sweeper.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <tbb/parallel_for.h>

namespace volcomp {

// Finds the nodes through which bundles pass on their way to the leaves that ask for light.
void ShadowSweep::Sweeper::findWay()
{
    std::set<openvdb::Coord> asking, nearby, nodes;
    for (std::size_t layer = 0; layer < m_cells.size(); ++layer) {
        for (const Cell& cell : m_cells[layer]) {
            if (!cell.asks) continue;
            asking.insert(originOf(cell, int(layer)) & ~(kNodeDim - 1));
        }
        m_cells[layer].clear();
    }
    for (const openvdb::Coord& node : asking) addNodesToLight(node, nearby, nodes);
    if (m_sweep.m_beyond) {
        m_beyond_shift =
            int(std::lround(std::log2(m_sweep.m_beyond->voxelSize() / m_tree.voxelSize())));
        for (const openvdb::Coord& node : nodes)
            if (nearby.count(node) == 0) m_far.insert(NodeTable::keyOf(node[0], node[1], node[2]));
    }
    m_way.reserve(nodes.size());
    for (const openvdb::Coord& node : nodes) m_way.emplace_back(firstLayerOf(node), node);
    std::sort(m_way.begin(), m_way.end());
}

// The first layer that lies in a node, before 0 if the volume begins inside of it.
int ShadowSweep::Sweeper::firstLayerOf(const openvdb::Coord& node) const
{
    const int s = m_lattice.sign > 0 ? node[m_lattice.a] : -(node[m_lattice.a] + kNodeDim);
    return int(std::floor((s - m_field.first_s) / kLeafDim));
}

bool ShadowSweep::Sweeper::waitsForNodes(int layer) const
{
    return m_next_of_way < m_way.size() && m_way[m_next_of_way].first <= layer;
}

void ShadowSweep::Sweeper::makeWay(int layer)
{
    const std::size_t first = m_next_of_way;
    while (waitsForNodes(layer)) ++m_next_of_way;
    if (m_next_of_way == first) return;
    std::fill(m_effective_of.begin(), m_effective_of.end(), -1);
    tbb::parallel_for(first, m_next_of_way, [&](std::size_t i) {
        if (!isFar(m_way[i].second)) makeTiles(m_way[i].second, m_way[i].first);
    });
    std::vector<std::vector<openvdb::Coord>> far(m_next_of_way - first);
    tbb::parallel_for(first, m_next_of_way, [&](std::size_t i) {
        if (isFar(m_way[i].second)) far[i - first] = farLeaves(m_way[i].second, m_way[i].first);
    });
    for (std::size_t i = first; i < m_next_of_way; ++i) {
        const openvdb::Coord& node = m_way[i].second;
        for (const openvdb::Coord& leaf : far[i - first]) addCell(leaf, VoxelTree::kEmpty, 0, true);
        if (isFar(node)) continue;
        const int table = m_tree.node(node[0], node[1], node[2]);
        if (table == VoxelTree::kEmpty) continue;
        m_tree.tiles()->forEachLeafOf(
            table, [&](int leaf, int n) { addCell(node + leafInNode(n), leaf, 0); });
    }
    const std::size_t end = std::min(m_cells.size(), std::size_t(layer + kNodeDim / kLeafDim));
    tbb::parallel_for(std::size_t(layer), end, [&](std::size_t l) {
        for (Cell& cell : m_cells[l])
            cell.bundles = bundlesThrough(cell.b, cell.c, kLeafDim, int(l));
    });
}

// Adds the nodes that light passes on its way to a node, and that node. Those of the last 128
// voxels and the node itself are near by.
void ShadowSweep::Sweeper::addNodesToLight(const openvdb::Coord& node,
                                           std::set<openvdb::Coord>& nearby,
                                           std::set<openvdb::Coord>& nodes) const
{
    // A bundle reaches as far beyond the rays that pass a place.
    constexpr double kBeside = kBundle + 2;
    const int a = m_lattice.a, across[2] = {m_lattice.b, m_lattice.c};
    const openvdb::CoordBBox& box = m_tree.bounds();
    const double near = m_lattice.sign > 0 ? node[a] : -(node[a] + double(kNodeDim)),
                 far = near + kNodeDim;
    LightLattice::Range rays[2];
    for (int axis = 0; axis < 2; ++axis) {
        const double x = node[across[axis]];
        rays[axis] = m_lattice.raysThrough(axis, x - kBeside, x + kNodeDim + kBeside, near, far);
        if (m_lattice.fans) {
            const double most = 1.02 / m_lattice.spacing1;
            rays[axis].low = std::max(rays[axis].low, -most);
            rays[axis].high = std::min(rays[axis].high, most);
        }
    }
    for (double s = near; s + kNodeDim > m_field.first_s; s -= kNodeDim) {
        if (m_lattice.fans && s + kNodeDim < m_lattice.s0) return;
        int low[2], high[2];
        bool inside = true;
        for (int axis = 0; axis < 2; ++axis) {
            const double from = m_lattice.fans ? std::max(s, m_lattice.s0) : s, to = s + kNodeDim;
            const auto [least, most] = std::minmax({m_lattice.at(axis, rays[axis].low, from),
                                                    m_lattice.at(axis, rays[axis].low, to),
                                                    m_lattice.at(axis, rays[axis].high, from),
                                                    m_lattice.at(axis, rays[axis].high, to)});
            const int b = across[axis];
            inside &= most >= box.min()[b] && least <= box.max()[b] + 1.0;
            low[axis] = int(std::max(least, double(box.min()[b]))) & ~(kNodeDim - 1);
            high[axis] = int(std::min(most, double(box.max()[b])));
        }
        if (!inside) return;
        openvdb::Coord at;
        at[a] = m_lattice.sign > 0 ? int(s) : int(-s) - kNodeDim;
        for (at[across[0]] = low[0]; at[across[0]] <= high[0]; at[across[0]] += kNodeDim)
            for (at[across[1]] = low[1]; at[across[1]] <= high[1]; at[across[1]] += kNodeDim) {
                nodes.insert(at);
                if (s >= near - kNodeDim) nearby.insert(at);
            }
    }
}

// Calls f(tile) for the tiles of a node that bundles pass which something behind them asks for.
// `first_layer` is the node's.
template <class F>
void ShadowSweep::Sweeper::forAskedTiles(const openvdb::Coord& node, int first_layer,
                                         const F& f) const
{
    for (int t = 0; t < kTilesOfNode; ++t) {
        const openvdb::Coord in_node((t >> 6) * kTileDim, (t >> 3 & 7) * kTileDim,
                                     (t & 7) * kTileDim),
            tile = node + in_node;
        const int along = in_node[m_lattice.a],
                  layer = first_layer
            + (m_lattice.sign > 0 ? along : kNodeDim - kTileDim - along) / kLeafDim;
        const Rectangle r = bundlesThrough(tile[m_lattice.b], tile[m_lattice.c], kTileDim, layer);
        bool asked = false;
        for (int b = std::max(r.low[0], m_all.low[0]); b <= std::min(r.high[0], m_all.high[0]); ++b)
            for (int c = std::max(r.low[1], m_all.low[1]); c <= std::min(r.high[1], m_all.high[1]);
                 ++c) {
                const std::size_t at = m_all.index(b, c);
                asked |= m_last[at] > layer && !m_bundles[at].dark;
            }
        if (asked) f(tile);
    }
}

// Makes the tiles of a node that are asked for.
void ShadowSweep::Sweeper::makeTiles(const openvdb::Coord& node, int first_layer) const
{
    const int table = m_tree.node(node[0], node[1], node[2]);
    if (table == VoxelTree::kEmpty) return;
    forAskedTiles(node, first_layer, [&](const openvdb::Coord& tile) {
        m_tree.leafIn(table, tile[0], tile[1], tile[2]);
    });
}

// The leaves of a far node's tiles that are asked for in which the voxels beyond have something.
std::vector<openvdb::Coord> ShadowSweep::Sweeper::farLeaves(const openvdb::Coord& node,
                                                            int first_layer) const
{
    std::vector<openvdb::Coord> leaves;
    forAskedTiles(node, first_layer, [&](const openvdb::Coord& tile) {
        if (!anyLeafBeyond(tile)) return;
        for (int k = 0; k < 8; ++k) {
            const openvdb::Coord leaf =
                tile.offsetBy(kLeafDim * (k >> 2), kLeafDim * (k >> 1 & 1), kLeafDim * (k & 1));
            // Coarser voxels may hang over.
            if (m_tree.bounds().isInside(leaf) && anyBeyond(leaf)) leaves.push_back(leaf);
        }
    });
    return leaves;
}

bool ShadowSweep::Sweeper::isFar(const openvdb::Coord& voxel) const
{
    return !m_far.empty() && m_far.count(NodeTable::keyOf(voxel[0], voxel[1], voxel[2])) > 0;
}

// The voxel beyond that holds the middle of a voxel: the middles of both trees' first voxels are at
// one place.
openvdb::Coord ShadowSweep::Sweeper::beyondOf(const openvdb::Coord& voxel) const
{
    const int shift = m_beyond_shift, half = 1 << shift >> 1;
    return {(voxel[0] + half) >> shift, (voxel[1] + half) >> shift, (voxel[2] + half) >> shift};
}

bool ShadowSweep::Sweeper::anyLeafBeyond(const openvdb::Coord& tile) const
{
    const openvdb::Coord low = beyondOf(tile), high = beyondOf(tile.offsetBy(kTileDim - 1));
    for (int x = low[0] & ~(kLeafDim - 1); x <= high[0]; x += kLeafDim)
        for (int y = low[1] & ~(kLeafDim - 1); y <= high[1]; y += kLeafDim)
            for (int z = low[2] & ~(kLeafDim - 1); z <= high[2]; z += kLeafDim)
                if (m_sweep.m_beyond->leafAt(x, y, z) != VoxelTree::kEmpty) return true;
    return false;
}

bool ShadowSweep::Sweeper::anyBeyond(const openvdb::Coord& leaf) const
{
    const openvdb::Coord low = beyondOf(leaf), high = beyondOf(leaf.offsetBy(kLeafDim - 1));
    const VoxelTree& tree = *m_sweep.m_beyond;
    for (int x = low[0]; x <= high[0]; ++x)
        for (int y = low[1]; y <= high[1]; ++y)
            for (int z = low[2]; z <= high[2]; ++z)
                if (tree.density(x, y, z) > 0) return true;
    return false;
}

// Writes the densities beyond where a leaf is, as they count on the way to the light.
void ShadowSweep::Sweeper::takeBeyond(const openvdb::Coord& leaf, const Vec3d& to_light,
                                      float* to) const
{
    const VoxelTree& tree = *m_sweep.m_beyond;
    openvdb::Coord last(std::numeric_limits<int>::max());
    float value = 0;
    for (int n = 0; n < kLeafSize; ++n) {
        const openvdb::Coord at = beyondOf(leaf.offsetBy(n >> 6, n >> 3 & 7, n & 7));
        if (at != last) {
            last = at;
            const int l = tree.leafAt(at[0], at[1], at[2]);
            const int voxel = (at[0] & 7) << 6 | (at[1] & 7) << 3 | (at[2] & 7);
            value = l == VoxelTree::kEmpty ? 0 : tree.densities(l)[voxel];
            if (value > 0 && m_sweep.m_directed)
                value = float(value * tree.directionFactor(l, voxel, to_light));
        }
        to[n] = value;
    }
}

openvdb::Coord ShadowSweep::Sweeper::originOf(const Cell& cell, int layer) const
{
    openvdb::Coord leaf;
    leaf[m_lattice.a] = int(m_lattice.sign > 0 ? planeAt(layer) : -planeAt(layer + 1));
    leaf[m_lattice.b] = cell.b;
    leaf[m_lattice.c] = cell.c;
    return leaf;
}

} // namespace volcomp
