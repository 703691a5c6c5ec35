// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/render.h"

#include <algorithm>

#include "volcomp/base/clock.h"
#include "volcomp/render/picture_tracer.h"
#include "volcomp/render/tile_renderer.h"
#include "volcomp/render/tree/voxel_levels.h"

namespace volcomp {
namespace {

void setShares(const RenderSums& sums, std::size_t lights, RenderStats& stats)
{
    double all = sums.ambient;
    for (const LightSum& light : sums.lights) all += light.shown;
    stats.lights.assign(lights, {});
    for (std::size_t l = 0; l < std::min(lights, sums.lights.size()); ++l) {
        const auto& [offered, arrived, shown] = sums.lights[l];
        if (all > 0) stats.lights[l].seen = shown / all;
        if (offered > 0) stats.lights[l].arrives = arrived / offered;
    }
    stats.ambient_seen = all > 0 ? sums.ambient / all : 0;
}

} // namespace

Image render(const Volume& volume, const std::vector<Material>& materials, const Camera& camera,
             const std::vector<Light>& lights, const RenderParams& params, const Progress& progress,
             RenderStats* stats, const SkinTracer* skins)
{
    return render(VoxelTree(volume), materials, camera, lights, params, progress, stats, skins);
}

Image render(const VoxelTree& tree, const std::vector<Material>& materials, const Camera& camera,
             const std::vector<Light>& lights, const RenderParams& params, const Progress& progress,
             RenderStats* stats, const SkinTracer* skins)
{
    camera.validate();
    params.validate();
    const double start = wallSeconds();
    const std::shared_ptr<const VoxelTree> finest(std::shared_ptr<void>(), &tree); // not owned
    const std::vector<VoxelLevel> levels = voxelLevels(finest, camera, params);
    const double made = wallSeconds();
    Image image =
        render(levels, materials, camera, lights, params, progress, stats, nullptr, skins);
    if (stats) stats->prepare_seconds += made - start;
    return image;
}

Image render(const std::vector<VoxelLevel>& levels, const std::vector<Material>& materials,
             const Camera& camera, const std::vector<Light>& lights, const RenderParams& params,
             const Progress& progress, RenderStats* stats, RenderWatch* watch,
             const SkinTracer* skins)
{
    if (levels.empty()) throw Error("render: expected at least one level of a volume, found none");
    const double start = wallSeconds();
    const PictureTracer tracer(levels, materials, camera, lights, params, skins);
    const double prepared = wallSeconds();

    RenderState own;
    TileRenderer tiles(tracer, lights, watch ? watch->state : own);
    const RenderSums sums = renderTiles(tiles, params.samples, progress, watch);
    if (stats) {
        stats->rays = sums.counts.rays;
        stats->shadow_rays = sums.counts.shadow_rays;
        stats->shaded_voxels = sums.counts.shaded_voxels;
        setShares(sums, lights.size(), *stats);
        stats->active_voxels = levels[0].tree->voxelCount();
        stats->skin_shadow_bytes = tracer.skinShadowBytes();
        stats->openness_bytes = tracer.opennessBytes();
        stats->openness_seconds = tracer.opennessSeconds();
        stats->prepare_seconds = prepared - start;
        stats->march_seconds = wallSeconds() - prepared;
    }
    return tiles.image();
}

} // namespace volcomp
