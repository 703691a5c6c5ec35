// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/sky/openness.h"

#include <algorithm>
#include <cmath>

#include "volcomp/base/interval.h"
#include "volcomp/render/sky/neighbour_directions.h"
#include "volcomp/render/sky/openness_builder.h"

namespace volcomp {

Openness::Openness(const VoxelTree& tree, const Cells& cells, double extinction,
                   const SkinTracer* skins, bool by_direction, std::size_t most_cells)
{
    const Vec3d axes[3] = {tree.directionToCorner({1, 0, 0}), tree.directionToCorner({0, 1, 0}),
                           tree.directionToCorner({0, 0, 1})};
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column) m_rotation(row, column) = axes[column][row];
    for (int d = 0; d < kDirections; ++d) {
        const NeighbourStep step = neighbourStep(d);
        m_directions[d] = tree.directionToWorld(Vec3d(step[0], step[1], step[2]).unit());
    }
    if (tree.empty() || cells.box.empty()) return;
    Builder builder(*this, tree, cells, extinction, by_direction);
    builder.layCells(most_cells);
    builder.addDensities();
    if (skins) builder.lookForSkins(*skins);
    builder.passAll();
}

const std::array<double, Openness::kDirections>& Openness::weights()
{
    static const std::array<double, kDirections> all = [] {
        std::array<double, kDirections> w{};
        for (int d = 0; d < kDirections; ++d) w[d] = neighbourWeight(d);
        return w;
    }();
    return all;
}

int Openness::nearest(const Vec3d& d) const
{
    const Vec3d in_grid = m_rotation * d;
    return nearestNeighbour(in_grid);
}

Openness::Around Openness::around(const Vec3d& at) const
{
    int low[3];
    float high_share[3];
    for (int a = 0; a < 3; ++a) { // there are at least three cells along each axis
        const double x = std::min(std::max(at[a], 0.0), double(m_size[a] - 1));
        low[a] = std::min(int(x), m_size[a] - 2);
        high_share[a] = float(x - low[a]);
    }
    Around result;
    for (int k = 0; k < 8; ++k) {
        const int up[3] = {k >> 2, k >> 1 & 1, k & 1};
        result.cells[k] = number(low[0] + up[0], low[1] + up[1], low[2] + up[2]);
        result.shares[k] = 1;
        for (int a = 0; a < 3; ++a) result.shares[k] *= up[a] ? high_share[a] : 1 - high_share[a];
    }
    return result;
}

namespace {

Openness::ByDirection allOpen()
{
    Openness::ByDirection all{};
    std::fill_n(all.begin(), Openness::kDirections, 1.0F);
    return all;
}

} // namespace

Openness::ByDirection Openness::open(const Vec3d& p) const
{
    if (m_passes.empty()) return allOpen();
    const Around near = around(toCells(p));
    ByDirection sum{};
    for (int k = 0; k < 8; ++k) {
        const Passes& cell = m_passes[near.cells[k]];
        const float share = near.shares[k] / 255;
        if (cell.visible == kAll)
            for (std::size_t d = 0; d < sum.size(); ++d) sum[d] += share * float(cell.volume[d]);
        else
            for (std::size_t d = 0; d < sum.size(); ++d)
                sum[d] += share * float(cell.visible >> d & 1 ? cell.volume[d] : 0);
    }
    return sum;
}

Openness::ByDirection Openness::openWithoutSkins(const Vec3d& p) const
{
    if (m_passes.empty()) return allOpen();
    const Vec3d at = toCells(p);
    bool inside = true;
    for (int a = 0; a < 3; ++a) inside = inside && at[a] >= 0 && at[a] <= m_size[a] - 1;
    ByDirection sum{};
    if (inside) {
        const Around near = around(at);
        for (int k = 0; k < 8; ++k)
            for (std::size_t d = 0; d < sum.size(); ++d)
                sum[d] += near.shares[k] / 255 * float(m_passes[near.cells[k]].volume[d]);
        return sum;
    }
    // Each direction by itself, from where its ray comes into the cells.
    for (int d = 0; d < kDirections; ++d) {
        const NeighbourStep step = neighbourStep(d);
        double from = 0, to = kInfinity;
        for (int a = 0; a < 3; ++a) {
            if (step[a] == 0) {
                if (!(at[a] >= 0 && at[a] <= m_size[a] - 1)) to = -1;
                continue;
            }
            const double low = (0 - at[a]) / step[a], high = (m_size[a] - 1 - at[a]) / step[a];
            from = std::max(from, std::min(low, high));
            to = std::min(to, std::max(low, high));
        }
        sum[d] = 1;
        if (!(from <= to)) continue;
        const Around near = around(at + from * Vec3d(step[0], step[1], step[2]));
        sum[d] = 0;
        for (int k = 0; k < 8; ++k)
            sum[d] += near.shares[k] / 255 * float(m_passes[near.cells[k]].volume[d]);
    }
    return sum;
}

double Openness::closed(const Vec3d& p) const
{
    if (m_closed.empty()) return 0;
    const Around near = around(toCells(p));
    float sum = 0;
    for (int k = 0; k < 8; ++k) sum += near.shares[k] * float(m_closed[near.cells[k]]);
    return double(sum) / 65535;
}

std::size_t Openness::memoryBytes() const
{
    return m_passes.size() * sizeof(Passes) + m_closed.size() * sizeof(std::uint16_t);
}

} // namespace volcomp
