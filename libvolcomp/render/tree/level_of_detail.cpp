// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/tree/level_of_detail.h"

#include <algorithm>
#include <cmath>

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include "volcomp/base/clock.h"

namespace volcomp {

LevelOfDetail::LevelOfDetail(const std::vector<VoxelLevel>& levels,
                             const std::vector<Material>& part_materials,
                             const std::vector<Light>& lights, const RenderParams& params,
                             const CameraRays& rays, const Crop& crop, const SkinTracer* skins)
    : m_materials(part_materials), m_soft(lights, params), m_params(params),
      m_skins(skins && !skins->empty() ? skins : nullptr)
{
    for (const VoxelLevel& level : levels) {
        Level& l = m_levels.emplace_back();
        static_cast<VoxelLevel&>(l) = level;
        l.integrator.emplace(*l.tree, m_materials, m_soft.lights(0), m_params);
        if (params.shadows == Shadows::sweep) sweep(l, rays, crop);
        if (m_skins && params.shadows != Shadows::none && !l.tree->empty()) {
            l.skin_shadow =
                std::make_unique<const SkinShadow>(*m_skins, *l.tree, m_soft.all(), params.shadows);
            l.integrator->useSkinShadow(*l.skin_shadow);
        }
    }
    makeOpenness();
    for (Level& l : m_levels) // last: they copy all that is above
        for (int part = 1; part < m_soft.parts(); ++part)
            l.other_parts.emplace_back(*l.integrator)
                .useLights(m_soft.lights(part), m_soft.numbers(part));
}

void LevelOfDetail::makeOpenness()
{
    if (m_levels.empty() || !m_levels[0].integrator->scene().wantsOpenness()) return;
    const double start = wallSeconds();
    const MarchScene& finest = m_levels[0].integrator->scene();
    // Light from all around and skins ask for directions, multiple scattering for P alone.
    m_openness = std::make_unique<const Openness>(finest.tree, finest.extinction, m_skins,
                                                  finest.hasSky() || m_skins);
    for (Level& l : m_levels) l.integrator->useOpenness(*m_openness);
    m_openness_seconds = wallSeconds() - start;
}

// Marks what a ray sees of a level: the volume as far as a skin, and the leaf in which that lies.
void LevelOfDetail::markLeaves(const Level& level, const CameraRay& ray,
                               std::vector<float>& seen) const
{
    std::optional<SkinTracer::Meeting> skin;
    if (m_skins) skin = m_skins->meeting(ray.origin, ray.direction, 0, level.end);
    if (skin && skin->distance <= level.start) return; // it hides the level
    const double depth = level.integrator->markLeaves(ray.origin, ray.direction, level.start,
                                                      skin ? skin->distance : level.end, seen);
    if (!skin || level.tree->empty()) return;
    const Vec3d p = level.tree->toCorner(ray.origin + ray.direction * skin->distance);
    for (int a = 0; a < 3; ++a)
        if (!(p[a] >= level.tree->bounds().min()[a] && p[a] < level.tree->bounds().max()[a] + 1.0))
            return;
    const int leaf =
        level.tree->leafAt(int(std::floor(p[0])), int(std::floor(p[1])), int(std::floor(p[2])));
    if (leaf != VoxelTree::kEmpty) seen[leaf] = std::max(seen[leaf], float(std::exp(-depth)));
}

// Sweeps light for the leaves that rays through every other pixel see.
void LevelOfDetail::sweep(Level& level, const CameraRays& rays, const Crop& crop)
{
    const VoxelTree& tree = *level.tree;
    tbb::enumerable_thread_specific<std::vector<float>> local(
        std::vector<float>(tree.leafCount(), 0));
    tbb::parallel_for(0, (crop.height + 1) / 2, [&](int row) {
        for (int x = 0; x < crop.width; x += 2) {
            const CameraRay ray = rays.ray(crop.x + x + 0.5, crop.y + 2 * row + 0.5);
            markLeaves(level, ray, local.local());
        }
    });
    std::vector<float> seen(tree.leafCount(), 0);
    for (const std::vector<float>& part : local)
        for (std::size_t i = 0; i < seen.size(); ++i) seen[i] = std::max(seen[i], part[i]);
    const Integrator& integrator = *level.integrator;
    level.sweep = std::make_unique<const ShadowSweep>(
        tree, m_soft.all(), seen, integrator.extinction(), integrator.scene().darkestToLight(),
        m_params.extinction == Extinction::directed);
    level.integrator->useSweep(*level.sweep);
}

RaySample LevelOfDetail::trace(const Vec3d& origin, const Vec3d& direction,
                               Integrator::Scratch& scratch, std::optional<SeenSkin>* seen,
                               int part) const
{
    RaySample sample;
    ++scratch.counts.rays;
    if (m_params.aovs) scratch.light_radiance.assign(m_soft.numbers(0).size(), Vec3d(0.0));
    scratch.haze = HazeRay(m_params.haze, origin, direction);
    std::optional<SkinHit> skin;
    if (m_skins) skin = m_skins->hit(origin, direction);
    const double end = skin ? skin->distance : kInfinity;
    const Level* last = &m_levels.front();
    for (const Level& l : m_levels) {
        if (l.start > 0 && (sample.transmittance < m_params.cutoff || l.start >= end)) break;
        l.byPart(part).traceFurther(sample, origin, direction, l.start, std::min(l.end, end),
                                    scratch);
        last = &l;
    }
    if (skin)
        addSkin(last->byPart(part).scene(), *m_skins, *skin, -direction, sample, scratch, seen);
    scratch.ambient_sum += sample.ambient[0] + sample.ambient[1] + sample.ambient[2];
    return sample;
}

std::size_t LevelOfDetail::skinShadowBytes() const
{
    std::size_t bytes = 0;
    for (const Level& l : m_levels)
        if (l.skin_shadow) bytes += l.skin_shadow->memoryBytes();
    return bytes;
}

} // namespace volcomp
