// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/skin/skin_shadow_map.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "volcomp/render/march/march.h"

namespace volcomp {
namespace {

constexpr float kNever = std::numeric_limits<float>::infinity();
constexpr double kSteepest = 32; ///< slant of a plane, voxels from ray to ray

int floorDivide(int x, int y) { return x >= 0 ? x / y : -((y - 1 - x) / y); }

/// Puts `made` into its place, or takes what another thread has put there.
template <class T>
T* settle(std::atomic<T*>& place, std::unique_ptr<std::remove_const_t<T>> made,
          std::atomic<std::size_t>& bytes)
{
    T* known = nullptr;
    if (!place.compare_exchange_strong(known, made.get())) return known;
    bytes += sizeof(T);
    return made.release();
}

} // namespace

SkinShadowMap::SkinShadowMap(const SkinTracer& skins, const VoxelTree& tree,
                             const LightLattice& rays)
    : m_skins(skins), m_tree(tree), m_lattice(rays)
{
    if (!rays.fans) m_per_spacing = 1 / rays.spacing0;
    m_bright.first = kNever;
    m_bright.rays.fill({kNever, 0, 0, 0});
    if (tree.empty()) return;
    const openvdb::CoordBBox& box = tree.bounds();
    const int a = rays.a;
    const double low = box.min()[a], high = box.max()[a] + 1.0;
    m_first_s = rays.sign > 0 ? low : -high;
    const double last_s = rays.sign > 0 ? high : -low;
    if (rays.fans) {
        if (last_s <= rays.s0 + 1e-3) return; // all of it lies on the other side of the light
        m_lattice.setFanSpacing(kSpacing, last_s);
    }
    for (int axis = 0; axis < 2; ++axis) {
        const int x = axis == 0 ? rays.b : rays.c;
        auto [first, last] =
            m_lattice.raysThrough(axis, box.min()[x], box.max()[x] + 1.0, m_first_s, last_s);
        if (rays.fans) { // 45 degrees at most, and a border for rounding
            const double most = 1.02 / m_lattice.spacing1;
            first = std::max(first, -most), last = std::min(last, most);
        }
        if (!(first <= last)) return;
        m_low[axis] = floorDivide(int(std::floor(first)) - 1, kStep);
        m_high[axis] = floorDivide(int(std::floor(last)) + 1, kStep);
    }
    const auto blocks = [&](int axis) { return (m_high[axis] - m_low[axis]) / kBlock + 1; };
    m_columns = blocks(1);
    m_blocks = std::vector<std::atomic<Block*>>(std::size_t(blocks(0)) * m_columns);
    m_bytes = m_blocks.size() * sizeof m_blocks[0];
}

SkinShadowMap::~SkinShadowMap()
{
    for (std::atomic<Block*>& place : m_blocks) {
        Block* block = place.load();
        if (!block) continue;
        for (auto& patch : block->patches)
            if (patch.load() != &m_bright) delete patch.load();
        delete block;
    }
}

std::optional<double> SkinShadowMap::lightAt(const Vec3d& p) const
{
    const double s = m_lattice.travel(p);
    if (m_blocks.empty() || !m_lattice.hasRaysAt(s)) return std::nullopt;
    const double per_spacing = m_lattice.fans ? 1 / m_lattice.spacing(s) : m_per_spacing;
    const double u = m_lattice.offsetFrom(0, p[m_lattice.b], s) * per_spacing,
                 v = m_lattice.offsetFrom(1, p[m_lattice.c], s) * per_spacing;
    const double border = kStep;
    if (!(u >= double(m_low[0]) * kStep && u < double(m_high[0]) * kStep + border
          && v >= double(m_low[1]) * kStep && v < double(m_high[1]) * kStep + border))
        return std::nullopt;
    const int i = floorToInt(u), j = floorToInt(v);
    const int patch_u = floorDivide(i, kStep), patch_v = floorDivide(j, kStep);
    const Patch& patch = patchAt(patch_u, patch_v);
    if (s <= patch.first) return 1;
    const double x = u - i, y = v - j;
    const Ray* at = &patch.rays[std::size_t(i - patch_u * kStep) * kSide + (j - patch_v * kStep)];
    const auto passes = [&](const Ray& ray, double du, double dv) {
        return double(s <= ray.s + std::max(0.0, double(ray.per_u) * du + double(ray.per_v) * dv)
                          + ray.bias);
    };
    return (1 - x) * ((1 - y) * passes(at[0], x, y) + y * passes(at[1], x, y - 1))
        + x * ((1 - y) * passes(at[kSide], x - 1, y) + y * passes(at[kSide + 1], x - 1, y - 1));
}

const SkinShadowMap::Patch& SkinShadowMap::patchAt(int u, int v) const
{
    const int from_u = u - m_low[0], from_v = v - m_low[1];
    auto& block_place = m_blocks[std::size_t(from_u / kBlock) * m_columns + from_v / kBlock];
    Block* block = block_place.load(std::memory_order_acquire);
    if (!block) block = settle(block_place, std::make_unique<Block>(), m_bytes);
    auto& place = block->patches[std::size_t(from_u % kBlock) * kBlock + from_v % kBlock];
    const Patch* patch = place.load(std::memory_order_acquire);
    if (!patch) patch = trace(u, v, place);
    return *patch;
}

// Traces the rays of a patch and puts it into its place.
const SkinShadowMap::Patch* SkinShadowMap::trace(int u, int v,
                                                 std::atomic<const Patch*>& place) const
{
    auto made = std::make_unique<Patch>();
    made->first = kNever;
    for (int i = 0; i < kSide; ++i)
        for (int j = 0; j < kSide; ++j) {
            Ray& ray = made->rays[std::size_t(i) * kSide + j];
            ray = rayAt(double(u) * kStep + i, double(v) * kStep + j);
            made->first = std::min(made->first, double(ray.s + ray.bias));
        }
    if (made->first < kNever) return settle(place, std::move(made), m_bytes);
    const Patch* known = nullptr;
    return place.compare_exchange_strong(known, &m_bright) ? &m_bright : known;
}

SkinShadowMap::Ray SkinShadowMap::rayAt(double u, double v) const
{
    const LightLattice& l = m_lattice;
    Vec3d way, start; // voxels: the way for one of s, and the ray's place at s
    way[l.a] = l.sign, way[l.b] = l.slopeOf(0, u), way[l.c] = l.slopeOf(1, v);
    const double s = l.fans ? l.s0 : m_first_s;
    start[l.a] = l.sign * s, start[l.b] = l.at(0, u, s), start[l.c] = l.at(1, v, s);
    const double per_s = way.length() * m_tree.voxelSize();
    const Vec3d world = m_tree.origin() + m_tree.directionToWorld(start * m_tree.voxelSize());
    const auto met =
        m_skins.meeting(world, m_tree.directionToWorld(way.unit()), l.fans ? 0 : -kInfinity);
    if (!met) return {kNever, 0, 0, 0};
    // The plane's points x + way ds + (spacing along b) du + (spacing along c) dv all lie across
    // its normal from x.
    const double at = s + met->distance / per_s, spacing = l.spacing(at);
    const Vec3d n = m_tree.directionToCorner(met->face);
    const double facing = std::min(n.dot(way), -1e-9);
    const auto slant = [&](int axis) {
        return float(std::clamp(-n[axis] * spacing / facing, -kSteepest, kSteepest));
    };
    return {float(at), slant(l.b), slant(l.c), float(std::min(-kBias / facing, kSteepest))};
}

} // namespace volcomp
