// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/march/march_scene.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "volcomp/base/interval.h"

namespace volcomp {

MarchScene::MarchScene(const VoxelTree& the_tree, std::vector<Material> part_materials,
                       const std::vector<Light>& the_lights, const RenderParams& the_params)
    : tree(the_tree), params(the_params), materials(std::move(part_materials)),
      directed(params.extinction == Extinction::directed && tree.isDirected()),
      extinction(params.tau * tree.voxelSize()),
      stop(params.cutoff > 0 && extinction > 0 ? darkestToLight() / extinction : kInfinity)
{
    for (const Material& m : materials)
        for (int code = 0; code < 64; ++code)
            lobes.push_back(makeLobe(m, spreadOf(std::min(code, kSpreadCodes - 1)),
                                     params.scattering == Scattering::multiple));
    std::vector<std::size_t> own(the_lights.size());
    std::iota(own.begin(), own.end(), 0);
    useLights(the_lights, own);
    const auto black = [](const Vec3d& v) { return v == Vec3d(0.0); };
    transmits_only = !params.aovs && params.haze.none() && !hasSky()
        && std::all_of(lights.begin(), lights.end(),
                       [&](const Light& l) { return black(l.strength); });
    if (hasSky()) sky = makeSkyTable(params, tree);
    if (params.filter == Filter::trilinear) dual = std::make_shared<DualTree>(tree);
}

void MarchScene::useLights(const std::vector<Light>& the_lights,
                           const std::vector<std::size_t>& shadows)
{
    lights = grid_lights = the_lights;
    shadow_of = shadows;
    light_rays.clear();
    for (Light& l : grid_lights) {
        l.position = tree.toCorner(l.position);
        l.direction = tree.directionToCorner(l.direction);
        light_rays.emplace_back(tree, Vec3d(0.0), -l.direction, 0);
    }
}

bool MarchScene::wantsOpenness() const
{
    return params.shadows != Shadows::none
        && (params.scattering == Scattering::multiple || hasSky());
}

constexpr double kWithoutCutoff = 12; // e^-12 is 6e-6

double MarchScene::darkestToLight() const
{
    return params.scattering == Scattering::multiple ? std::max(darkest(), kWithoutCutoff)
                                                     : darkest();
}

double MarchScene::darkest() const
{
    return params.cutoff > 0 ? -std::log(params.cutoff) : kWithoutCutoff;
}

} // namespace volcomp
