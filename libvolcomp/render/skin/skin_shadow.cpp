// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/skin/skin_shadow.h"

#include <cmath>

namespace volcomp {

SkinShadow::SkinShadow(const SkinTracer& skins, const VoxelTree& tree,
                       const std::vector<Light>& lights, Shadows shadows)
    : m_skins(skins), m_tree(tree), m_lights(lights), m_shadows(shadows)
{
    if (shadows != Shadows::sweep) return;
    for (const Light& light : lights) {
        auto& maps = m_maps.emplace_back();
        if (light.kind == LightKind::directional) {
            maps[0] = std::make_unique<const SkinShadowMap>(
                skins, tree,
                LightLattice::parallel(tree.directionToCorner(light.direction),
                                       SkinShadowMap::kSpacing));
            continue;
        }
        for (int side = 0; side < 6; ++side)
            maps[std::size_t(side)] = std::make_unique<const SkinShadowMap>(
                skins, tree,
                LightLattice::fan(tree.toCorner(light.position), side / 2, side % 2 ? 1 : -1));
    }
}

double SkinShadow::lightAt(std::size_t light, const Vec3d& p) const
{
    if (m_shadows == Shadows::none) return 1;
    if (m_shadows == Shadows::sweep) {
        std::size_t side = 0;
        if (m_lights[light].kind != LightKind::directional) {
            const Vec3d from_light = p - m_tree.toCorner(m_lights[light].position);
            const int a = largestAxis(from_light);
            side = 2 * std::size_t(a) + (from_light[a] > 0);
        }
        if (const auto known = m_maps[light][side]->lightAt(p)) return *known;
    }
    return isBright(light, p);
}

// By a ray.
bool SkinShadow::isBright(std::size_t light, const Vec3d& p) const
{
    const Vec3d world = m_tree.origin() + m_tree.directionToWorld(p * m_tree.voxelSize());
    if (m_lights[light].kind == LightKind::directional)
        return !m_skins.isOccluded(world, -m_lights[light].direction, kInfinity);
    const Vec3d way = m_lights[light].position - world;
    const double distance = way.length();
    return !(distance > 0) || !m_skins.isOccluded(world, way / distance, distance);
}

std::size_t SkinShadow::memoryBytes() const
{
    std::size_t bytes = 0;
    for (const auto& maps : m_maps)
        for (const auto& map : maps)
            if (map) bytes += sizeof *map + map->memoryBytes();
    return bytes;
}

} // namespace volcomp
