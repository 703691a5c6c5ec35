// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/tree/level_of_detail.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

namespace volcomp {

LevelOfDetail::LevelOfDetail(const std::vector<VoxelLevel>& levels,
                             const std::vector<Material>& part_materials,
                             const std::vector<Light>& lights, const RenderParams& params,
                             const CameraRays& rays, const Crop& crop)
    : m_materials(part_materials), m_lights(lights), m_params(params)
{
    for (const VoxelLevel& level : levels) {
        Level& l = m_levels.emplace_back();
        static_cast<VoxelLevel&>(l) = level;
        l.integrator.emplace(*l.tree, m_materials, m_lights, m_params);
        if (params.shadows == Shadows::sweep) sweep(l, rays, crop);
    }
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
            level.integrator->markLeaves(ray.origin, ray.direction, level.start, level.end,
                                         local.local());
        }
    });
    std::vector<float> seen(tree.leafCount(), 0);
    for (const std::vector<float>& part : local)
        for (std::size_t i = 0; i < seen.size(); ++i) seen[i] = std::max(seen[i], part[i]);
    const Integrator& integrator = *level.integrator;
    level.sweep = std::make_unique<const ShadowSweep>(tree, m_lights, seen, integrator.extinction(),
                                                      integrator.darkest(),
                                                      m_params.extinction == Extinction::directed);
    level.integrator->useSweep(*level.sweep);
}

RaySample LevelOfDetail::trace(const Vec3d& origin, const Vec3d& direction,
                               Integrator::Scratch& scratch) const
{
    RaySample sample;
    ++scratch.counts.rays;
    if (m_params.aovs) scratch.light_radiance.assign(m_lights.size(), Vec3d(0.0));
    for (const Level& l : m_levels) {
        if (l.start > 0 && sample.transmittance < m_params.cutoff) break;
        l.integrator->traceFurther(sample, origin, direction, l.start, l.end, scratch);
    }
    return sample;
}

} // namespace volcomp
