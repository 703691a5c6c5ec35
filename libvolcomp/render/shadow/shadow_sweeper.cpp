// What of a light's field is asked for, and what is kept of it.
#include "volcomp/render/shadow/shadow_sweeper.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include <tbb/parallel_for.h>

namespace volcomp {
namespace {

// 255 e^(-x/2) for x >= 0, to a tenth of a unit.
inline float codeOf(float x)
{
    const float y = std::max(-x * 0.72134752f, -60.0f); // log2
    const int whole = int(y) - 1;                       // y < 0: at or below floor(y)
    const float f = y - float(whole);                   // 0 ... 2
    const float p = 1
        + f * (0.69315f + f * (0.240227f + f * (0.0555041f + f * (0.00961813f + f * 0.00133336f))));
    const std::int32_t bits = (whole + 127) << 23;
    float scale;
    std::memcpy(&scale, &bits, sizeof scale);
    return 255 * p * scale;
}

double square(double x) { return x * x; }

template <class Rectangle, class F>
void forEachBundle(const Rectangle& r, const F& f)
{
    for (int b = r.low[0]; b <= r.high[0]; ++b)
        for (int c = r.low[1]; c <= r.high[1]; ++c) f(b, c);
}

} // namespace

bool ShadowSweep::Sweeper::run()
{
    sortLeaves();
    setSpacing();
    lookUnder();
    markNeeded();
    if (m_all.empty()) return false;
    m_bundles.resize(m_all.size());
    if (m_sweep.m_fibre) m_effective_of.assign(m_tree.leafCount(), -1);
    for (int layer = 0; layer < int(m_field.planes.size()); ++layer) {
        keep(layer);
        if (layer < int(m_cells.size())) advance(layer);
    }
    return true;
}

void ShadowSweep::Sweeper::sortLeaves()
{
    const openvdb::CoordBBox& box = m_tree.bounds();
    const int a = m_lattice.a, layers = (box.max()[a] - box.min()[a] + 1) / kLeafDim;
    m_field.first_s = m_lattice.sign > 0 ? box.min()[a] : -(box.max()[a] + 1.0);
    m_field.planes.resize(layers + 1);
    m_cells.resize(layers);
    m_tree.forEachCell([&](const openvdb::Coord& origin, int leaf) {
        const int layer = (origin[a] - box.min()[a]) / kLeafDim;
        m_cells[m_lattice.sign > 0 ? layer : layers - 1 - layer].push_back(
            {leaf, origin[m_lattice.b], origin[m_lattice.c], {}});
    });
}

// Light is asked for there, from a plane behind the source.
bool ShadowSweep::Sweeper::asks(const Cell& cell, int layer) const
{
    if (!(m_seen[cell.leaf] > 0) || m_tree.leaf(cell.leaf).uniform) return false;
    if (!m_lattice.fans) return true;
    const double s = planeAt(layer);
    if (s <= m_lattice.s0 + 1e-3) return false;
    // Inside the pyramid, and inside the spot's cone.
    const double reach = s + kLeafDim - m_lattice.s0;
    const double b = cell.b - m_lattice.origin[0], c = cell.c - m_lattice.origin[1];
    if (b > reach || b + kLeafDim < -reach || c > reach || c + kLeafDim < -reach) return false;
    if (m_light.kind != LightKind::spot) return true;
    Vec3d middle(0.0);
    middle[m_lattice.a] = m_lattice.sign * (s + kLeafDim / 2 - m_lattice.s0);
    middle[m_lattice.b] = b + kLeafDim / 2;
    middle[m_lattice.c] = c + kLeafDim / 2;
    const double distance = middle.length(), radius = kLeafDim * 0.87;
    if (distance <= radius) return true;
    const double cosine = m_tree.directionToWorld(middle / distance).dot(m_light.direction);
    return std::acos(std::min(1.0, std::max(-1.0, cosine))) - std::asin(radius / distance)
        <= m_light.angle;
}

void ShadowSweep::Sweeper::setSpacing()
{
    if (!m_lattice.fans) return;
    int farthest = 0;
    for (int layer = 0; layer < int(m_cells.size()); ++layer)
        if (std::any_of(m_cells[layer].begin(), m_cells[layer].end(),
                        [&](const Cell& cell) { return asks(cell, layer); }))
            farthest = layer;
    m_lattice.setFanSpacing(
        kSpacing, planeAt(farthest + 1)); // up to the far side: no wider than Row::pass() can take
    m_field.lattice = m_lattice;
}

ShadowSweep::Rectangle ShadowSweep::Sweeper::under(const Cell& cell, int layer) const
{
    Rectangle r;
    for (int axis = 0; axis < 2; ++axis) {
        const int x = axis == 0 ? cell.b : cell.c;
        double low, high;
        m_lattice.raysThrough(axis, x, x + kLeafDim, planeAt(layer), planeAt(layer + 1), low, high);
        if (m_lattice.fans) { // of the pyramid, with a border
            const double most = 1.02 / m_lattice.spacing1;
            low = std::max(low, -most);
            high = std::min(high, most);
            if (low > high) return {};
        }
        r.low[axis] = floorDivide(int(std::floor(low - 0.01)) - 1, kBundle);
        r.high[axis] = floorDivide(int(std::floor(high + 0.01)), kBundle);
    }
    return r;
}

void ShadowSweep::Sweeper::lookUnder()
{
    tbb::parallel_for(std::size_t(0), m_cells.size(), [&](std::size_t layer) {
        for (Cell& cell : m_cells[layer]) {
            cell.under = under(cell, int(layer));
            cell.asks = asks(cell, int(layer));
        }
    });
}

// A leaf asks for the planes before and behind it.
void ShadowSweep::Sweeper::markNeeded()
{
    for (std::size_t layer = 0; layer < m_cells.size(); ++layer)
        for (const Cell& cell : m_cells[layer])
            if (cell.asks)
                for (const std::size_t p : {layer, layer + 1})
                    m_field.planes[p].bundles.add(cell.under);
    std::size_t size = 0;
    for (Plane& plane : m_field.planes) {
        plane.first = size;
        size += plane.bundles.size();
        m_all.add(plane.bundles);
    }
    m_field.patches.assign(size, kUnknown);
    m_weights.assign(size, 0);
    m_last.assign(m_all.size(), -1);
    for (std::size_t layer = 0; layer < m_cells.size(); ++layer)
        for (const Cell& cell : m_cells[layer])
            if (cell.asks)
                for (const std::size_t p : {layer, layer + 1})
                    forEachBundle(cell.under, [&](int b, int c) {
                        const std::size_t at =
                            m_field.planes[p].first + m_field.planes[p].bundles.index(b, c);
                        m_field.patches[at] = kBright;
                        if (p == layer) m_weights[at] = std::max(m_weights[at], m_seen[cell.leaf]);
                        m_last[m_all.index(b, c)] = int(p);
                    });
}

// Writes what is asked for at a plane.
void ShadowSweep::Sweeper::keep(int layer)
{
    const Plane& plane = m_field.planes[layer];
    struct Patch {
        int b, c;
        std::int32_t* patch;
        bool fine;
    };
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
        patches.push_back({b, c, &m_field.patches[at], m_weights[at] * brightest >= kFinePatch});
    });
    std::size_t next = m_field.codes.size() / kUnit;
    for (const Patch& p : patches) {
        *p.patch = std::int32_t(2 * next + p.fine);
        next += (p.fine ? kRays : kRoughRays) / kUnit;
    }
    m_field.codes.resize(next * kUnit);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, patches.size(), 16),
                      [&](const auto& range) {
                          for (std::size_t i = range.begin(); i < range.end(); ++i)
                              write(patches[i].b, patches[i].c, patches[i].fine,
                                    &m_field.codes[std::size_t(*patches[i].patch >> 1) * kUnit]);
                      });
}

// Of ray (b, c), for a unit of travel.
double ShadowSweep::Sweeper::rayLength(int b, int c) const
{
    return std::sqrt(1 + square(m_lattice.slopeOf(0, b)) + square(m_lattice.slopeOf(1, c)));
}

void ShadowSweep::Sweeper::write(int b, int c, bool fine, std::uint8_t* codes) const
{
    const float* sums = m_bundles[m_all.index(b, c)].sums.get();
    const int step = fine ? 1 : kStride;
    float scale[kSide];
    for (int row = 0; row < kSide; row += step) {
        if (row == 0 || m_lattice.fans)
            for (int j = 0; j < kSide; ++j)
                scale[j] =
                    float(m_sweep.m_extinction * rayLength(b * kBundle + row, c * kBundle + j));
        float values[kSide];
        for (int j = 0; j < kSide; ++j) values[j] = codeOf(sums[row * kSide + j] * scale[j]) + 0.5f;
        for (int j = 0; j < kSide; j += step) *codes++ = std::uint8_t(values[j]);
    }
}

} // namespace volcomp
