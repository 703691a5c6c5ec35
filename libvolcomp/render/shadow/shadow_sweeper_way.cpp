// SPDX-License-Identifier: Apache-2.0
// What a tree that is made on the way has to make before light is swept through it.
#include "volcomp/render/shadow/shadow_sweeper.h"

#include <algorithm>
#include <cmath>

#include <tbb/parallel_for.h>

namespace volcomp {

// Finds the nodes through which bundles pass on their way to the leaves that ask for light.
void ShadowSweep::Sweeper::findWay()
{
    std::set<openvdb::Coord> asking, nodes;
    for (std::size_t layer = 0; layer < m_cells.size(); ++layer) {
        for (const Cell& cell : m_cells[layer]) {
            if (!cell.asks) continue;
            openvdb::Coord leaf;
            leaf[m_lattice.a] =
                int(m_lattice.sign > 0 ? planeAt(int(layer)) : -planeAt(int(layer) + 1));
            leaf[m_lattice.b] = cell.b;
            leaf[m_lattice.c] = cell.c;
            asking.insert(leaf & ~(kNodeDim - 1));
        }
        m_cells[layer].clear();
    }
    for (const openvdb::Coord& node : asking) addNodesToLight(node, nodes);
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
    tbb::parallel_for(first, m_next_of_way,
                      [&](std::size_t i) { makeTiles(m_way[i].second, m_way[i].first); });
    for (std::size_t i = first; i < m_next_of_way; ++i) {
        const openvdb::Coord& node = m_way[i].second;
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

// Adds the nodes that light passes on its way to a node, and that node.
void ShadowSweep::Sweeper::addNodesToLight(const openvdb::Coord& node,
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
            for (at[across[1]] = low[1]; at[across[1]] <= high[1]; at[across[1]] += kNodeDim)
                nodes.insert(at);
    }
}

// Makes the tiles of a node that bundles pass which something behind them asks for. `first_layer`
// is the node's.
void ShadowSweep::Sweeper::makeTiles(const openvdb::Coord& node, int first_layer) const
{
    const int table = m_tree.node(node[0], node[1], node[2]);
    if (table == VoxelTree::kEmpty) return;
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
        if (asked) m_tree.leafIn(table, tile[0], tile[1], tile[2]);
    }
}

} // namespace volcomp
