// SPDX-License-Identifier: Apache-2.0
// Which part of a light's field is asked for, and what is kept of it.
#include "volcomp/render/shadow/shadow_sweeper.h"

#include <algorithm>
#include <cmath>

#include <tbb/parallel_for.h>

namespace volcomp {
namespace {

/// Calls f(b, c) for each bundle of a rectangle.
template <class Rectangle, class F>
void forEachBundle(const Rectangle& r, const F& f)
{
    for (int b = r.low[0]; b <= r.high[0]; ++b)
        for (int c = r.low[1]; c <= r.high[1]; ++c) f(b, c);
}

} // namespace

bool ShadowSweep::Sweeper::begin()
{
    sortLeaves();
    setSpacing();
    visitCells();
    markNeeded();
    if (m_all.empty()) return false;
    if (m_tree.tiles()) findWay();
    m_bundles.resize(m_all.size());
    return true;
}

void ShadowSweep::Sweeper::pass(int layer)
{
    if (m_sweep.m_directed) m_effective_of.resize(m_tree.leafCount(), -1);
    keep(layer);
    if (layer >= int(m_cells.size())) return;
    push(layer);
    std::vector<Cell>().swap(m_cells[std::size_t(layer)]);
}

// Sorts the leaves by layer; of a tree that is made on the way those that ask for light.
void ShadowSweep::Sweeper::sortLeaves()
{
    const openvdb::CoordBBox& box = m_tree.bounds();
    const int a = m_lattice.a, layers = (box.max()[a] - box.min()[a] + 1) / kLeafDim;
    m_field.first_s = m_lattice.sign > 0 ? box.min()[a] : -(box.max()[a] + 1.0);
    m_field.planes.resize(layers + 1);
    m_cells.resize(layers);
    if (m_tree.tiles())
        m_tree.tiles()->forEachKnownPlace([&](const openvdb::Coord& origin, std::size_t place) {
            if (place < m_seen.size() && m_seen[place] > 0)
                addCell(origin, VoxelTree::kEmpty, m_seen[place]);
        });
    else
        m_tree.forEachCell([&](const openvdb::Coord& origin, int leaf) {
            addCell(origin, leaf, m_tree.leaf(leaf).uniform ? 0 : m_seen[std::size_t(leaf)]);
        });
}

void ShadowSweep::Sweeper::addCell(const openvdb::Coord& origin, int leaf, float seen, bool far)
{
    const int a = m_lattice.a, low = m_tree.bounds().min()[a], layers = int(m_cells.size());
    const int layer = (origin[a] - low) / kLeafDim;
    m_cells[std::size_t(m_lattice.sign > 0 ? layer : layers - 1 - layer)].push_back(
        {leaf, origin[m_lattice.b], origin[m_lattice.c], seen, {}, false, far});
}

// Whether a leaf needs this field's light: it is seen, and some of it lies behind the source,
// inside the field's pyramid and inside the spot's cone. Uniform leaves stand in more than one
// place, so they go by rays: their weight is 0.
bool ShadowSweep::Sweeper::asksForLight(const Cell& cell, int layer) const
{
    if (!(cell.seen > 0)) return false;
    if (!m_lattice.fans) return true;
    const double s = planeAt(layer);
    if (!m_lattice.hasRaysAt(s)) return false;
    const double reach = s + kLeafDim - m_lattice.s0;
    const double b = cell.b - m_lattice.origin[0], c = cell.c - m_lattice.origin[1];
    if (b > reach || b + kLeafDim < -reach || c > reach || c + kLeafDim < -reach) return false;
    if (m_light.kind != LightKind::spot) return true;
    Vec3d middle(0.0);
    middle[m_lattice.a] = m_lattice.sign * (s + kLeafDim / 2 - m_lattice.s0);
    middle[m_lattice.b] = b + kLeafDim / 2;
    middle[m_lattice.c] = c + kLeafDim / 2;
    return mayBeInCone(middle);
}

// Whether the sphere around a leaf, whose middle is given from the light, reaches into the cone.
bool ShadowSweep::Sweeper::mayBeInCone(const Vec3d& from_light) const
{
    const double distance = from_light.length(),
                 radius = kLeafDim * 0.87; // half a leaf's diagonal, sqrt(3) / 2 of its edge
    if (distance <= radius) return true;
    const double cosine = m_tree.directionToWorld(from_light / distance).dot(m_light.direction);
    return std::acos(std::min(1.0, std::max(-1.0, cosine))) - std::asin(radius / distance)
        <= m_light.angle;
}

// A fan's rays are kSpacing apart on the far side of the last layer that asks for light, so that
// nowhere they are further apart than pushRays() can take.
void ShadowSweep::Sweeper::setSpacing()
{
    if (!m_lattice.fans) return;
    int farthest = 0;
    for (int layer = 0; layer < int(m_cells.size()); ++layer)
        if (std::any_of(m_cells[layer].begin(), m_cells[layer].end(),
                        [&](const Cell& cell) { return asksForLight(cell, layer); }))
            farthest = layer;
    m_lattice.setFanSpacing(kSpacing, planeAt(farthest + 1));
    m_field.lattice = m_lattice;
}

ShadowSweep::Rectangle ShadowSweep::Sweeper::bundlesThrough(int b, int c, int width,
                                                            int layer) const
{
    constexpr double kPyramid = 1.02; // half its width at distance 1, with a border for rounding
    Rectangle r;
    for (int axis = 0; axis < 2; ++axis) {
        const int x = axis == 0 ? b : c;
        auto [low, high] =
            m_lattice.raysThrough(axis, x, x + width, planeAt(layer), planeAt(layer) + width);
        if (m_lattice.fans) {
            const double most = kPyramid / m_lattice.spacing1;
            low = std::max(low, -most);
            high = std::min(high, most);
            if (low > high) return {};
        }
        r.low[axis] = floorDivide(int(std::floor(low - 0.01)) - 1, kBundle);
        r.high[axis] = floorDivide(int(std::floor(high + 0.01)), kBundle);
    }
    return r;
}

void ShadowSweep::Sweeper::visitCells()
{
    tbb::parallel_for(std::size_t(0), m_cells.size(), [&](std::size_t layer) {
        for (Cell& cell : m_cells[layer]) {
            cell.bundles = bundlesThrough(cell.b, cell.c, kLeafDim, int(layer));
            cell.asks = asksForLight(cell, int(layer));
        }
    });
}

// A leaf asks for the planes before and behind it.
void ShadowSweep::Sweeper::markNeeded()
{
    const auto forEachAsked = [&](auto&& f) { // f(cell, plane)
        for (std::size_t layer = 0; layer < m_cells.size(); ++layer)
            for (const Cell& cell : m_cells[layer])
                if (cell.asks)
                    for (const std::size_t plane : {layer, layer + 1})
                        f(cell, plane, plane == layer);
    };
    forEachAsked([&](const Cell& cell, std::size_t plane, bool) {
        m_field.planes[plane].bundles.add(cell.bundles);
    });
    std::size_t size = 0;
    for (Plane& plane : m_field.planes) {
        plane.first = size;
        size += plane.bundles.size();
        m_all.add(plane.bundles);
    }
    m_field.patches.assign(size, kUnknown);
    m_weights.assign(size, 0);
    m_last.assign(m_all.size(), -1);
    forEachAsked([&](const Cell& cell, std::size_t plane, bool is_behind_plane) {
        const Plane& p = m_field.planes[plane];
        forEachBundle(cell.bundles, [&](int b, int c) {
            const std::size_t at = p.first + p.bundles.index(b, c);
            m_field.patches[at] = kBright;
            if (is_behind_plane) m_weights[at] = std::max(m_weights[at], cell.seen);
            m_last[m_all.index(b, c)] = int(plane);
        });
    });
}

// Marks the patches of a plane that are dark and finds those whose codes must be written. What is
// asked for and has met no particle stays bright.
std::vector<ShadowSweep::Sweeper::Patch> ShadowSweep::Sweeper::patchesToWrite(int layer)
{
    const Plane& plane = m_field.planes[layer];
    std::vector<Patch> patches;
    forEachBundle(plane.bundles, [&](int b, int c) {
        const std::size_t at = plane.first + plane.bundles.index(b, c);
        const Bundle& bundle = m_bundles[m_all.index(b, c)];
        if (m_field.patches[at] == kUnknown || (!bundle.sums && !bundle.dark)) return;
        if (bundle.dark) {
            m_field.patches[at] = kDark;
            return;
        }
        const float brightest = std::exp(-float(m_sweep.m_extinction) * bundle.least);
        patches.push_back({{b, c}, &m_field.patches[at], m_weights[at] * brightest >= kFinePatch});
    });
    return patches;
}

// Writes what is asked for at a plane.
void ShadowSweep::Sweeper::keep(int layer)
{
    const std::vector<Patch> patches = patchesToWrite(layer);
    std::size_t next = m_field.codes.size() / kUnit;
    for (const Patch& p : patches) {
        *p.at = PatchPlace(2 * next + p.fine);
        next += (p.fine ? kRays : kRoughRays) / kUnit;
    }
    m_field.codes.resize(next * kUnit);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, patches.size(), 16),
                      [&](const auto& range) {
                          for (std::size_t i = range.begin(); i < range.end(); ++i)
                              write(patches[i]);
                      });
}

void ShadowSweep::Sweeper::write(const Patch& patch)
{
    const Bundle& bundle = m_bundles[m_all.index(patch.bundle.b, patch.bundle.c)];
    encodeTransmittances(raysAt(patch.bundle, 0), *bundle.sums, m_sweep.m_extinction,
                         patch.fine ? 1 : kStride,
                         &m_field.codes[std::size_t(*patch.at >> 1) * kUnit]);
}

} // namespace volcomp
