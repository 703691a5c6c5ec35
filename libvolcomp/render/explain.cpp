// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/explain.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "volcomp/base/error.h"
#include "volcomp/base/interval.h"
#include "volcomp/render/picture_tracer.h"

namespace volcomp {
namespace {

bool shinesNowhere(const RenderParams& params, const std::vector<Light>& lights)
{
    return params.ambient == Vec3d(0.0) && params.dome.black() && params.haze.none()
        && std::all_of(lights.begin(), lights.end(),
                       [](const Light& l) { return l.strength == Vec3d(0.0); });
}

std::vector<ExplainedPart> partsOf(const SeenSegment& seen, const Vec3d& direction)
{
    const VoxelTree& tree = seen.scene.tree;
    std::vector<ExplainedPart> parts;
    for (const SeenVoxel& v : seen.shading.voxels) {
        const std::size_t first = parts.size();
        double total = 0;
        tree.contents(v.leaf, v.voxel, [&](const VoxelContent& content) {
            ExplainedPart part;
            part.voxel = openvdb::Coord(v.cell[0], v.cell[1], v.cell[2]);
            part.material = tree.parts()[content.part].material;
            part.kind = tree.parts()[content.part].kind;
            part.density = content.density;
            part.share = content.density
                * (seen.scene.directed ? tree.directionFactor(content, direction) : 1.0);
            part.directed = content.directed;
            part.direction = content.directed ? content.direction : Vec3d(0.0);
            part.spread = content.directed ? spreadOf(content.spread_code) : 1;
            part.colour = content.colour;
            total += part.share;
            parts.push_back(part);
        });
        for (std::size_t i = first; i < parts.size(); ++i)
            parts[i].share = total > 0 ? v.share * parts[i].share / total : 0;
    }
    return parts;
}

ExplainedLight explained(const SeenSegment& seen, const SeenLight& light)
{
    const MarchScene& scene = seen.scene;
    const Vec3d middle = 0.5 * (seen.segment.p_begin + seen.segment.p_end);
    double weight = illuminate(scene.grid_lights[light.light], middle, 0.5).weight;
    if (scene.lights[light.light].kind != LightKind::directional) // distances were in voxels
        weight /= scene.tree.voxelSize() * scene.tree.voxelSize();
    return {light.light,      weight * scene.lights[light.light].strength,
            light.from_light, light.transmittance,
            light.radiance,   light.scattered};
}

ExplainedInterval explained(const SeenSegment& seen, const std::vector<VoxelLevel>& levels,
                            const Vec3d& direction)
{
    ExplainedInterval interval;
    while (levels[interval.level].tree.get() != &seen.scene.tree) ++interval.level;
    interval.voxel_size = seen.scene.tree.voxelSize();
    const int* cell = seen.segment.cell;
    interval.voxel = openvdb::Coord(cell[0], cell[1], cell[2]);
    interval.begin = seen.segment.t * interval.voxel_size;
    interval.end = seen.segment.end * interval.voxel_size;
    interval.depth = seen.segment.delta;
    interval.transmittance = seen.transmittance;
    // The sum (4) attenuates a sample by its own depth, too; the observer is told what is left.
    if (seen.scene.params.integration == Integration::riemann)
        interval.transmittance *= std::exp(seen.segment.delta);
    interval.weight = seen.weight;
    interval.parts = partsOf(seen, direction);
    for (const SeenLight& light : seen.lights) interval.lights.push_back(explained(seen, light));
    interval.ambient = seen.ambient;
    return interval;
}

/// Where nothing shines, a render only sums the depth, and stops where that is dark at the end of a
/// leaf instead of an interval. Drops the intervals behind the depth at which it stopped.
void dropBehind(double transmittance, std::vector<ExplainedInterval>& intervals)
{
    double depth = 0;
    const double end = -std::log(transmittance) * (1 - 1e-9);
    for (std::size_t i = 0; i < intervals.size(); depth += intervals[i++].depth)
        if (depth >= end) {
            intervals.resize(i);
            return;
        }
}

ExplainedSkin explained(const SeenSkin& seen, const std::vector<Light>& lights,
                        const SkinTracer& skins)
{
    const SkinMesh& mesh = skins.meshes()[seen.hit.skin];
    ExplainedSkin skin{mesh.name,         mesh.material.name, seen.hit.distance, seen.transmittance,
                       seen.hit.position, seen.hit.normal,    seen.hit.colour,   {},
                       seen.ambient};
    for (const SeenLight& l : seen.lights) {
        const Light& light = lights[l.light];
        skin.lights.push_back({l.light,
                               illuminate(light, seen.hit.position, 1e-6).weight * light.strength,
                               l.from_light, l.transmittance, l.radiance, l.scattered});
    }
    return skin;
}

void addSums(const RenderParams& params, std::size_t lights, const HazeRay& haze, RayExplanation& e)
{
    e.light_sums.assign(lights, Vec3d(0.0));
    const auto add = [&](const std::vector<ExplainedLight>& terms, const Vec3d& ambient) {
        for (const ExplainedLight& light : terms) {
            e.light_sums[light.light] += light.adds + light.scattered;
            e.radiance += light.adds + light.scattered;
        }
        e.ambient += ambient;
    };
    for (const ExplainedInterval& interval : e.intervals) add(interval.lights, interval.ambient);
    if (e.skin) add(e.skin->lights, e.skin->ambient);
    const double clear = haze.transmittance(kInfinity);
    e.background = e.transmittance * clear * params.backdrop(e.direction);
    e.haze += e.transmittance * (1 - clear) * haze.colour();
    e.radiance += e.ambient + e.background + e.haze;
    e.alpha = params.hasBackdrop() ? 1 : 1 - e.transmittance * clear;
}

} // namespace

void requirePixel(const RenderParams& params, int x, int y, const std::string& option)
{
    params.validate();
    const Crop crop = pixelsOf(params);
    if (x >= crop.x && y >= crop.y && x < crop.x + crop.width && y < crop.y + crop.height) return;
    throw Error(fmt::format("{}: expected a pixel of the {}, X from {} to {} and Y from {} to {}, "
                            "found {},{}",
                            option, params.crop.width > 0 ? "picture's crop" : "picture", crop.x,
                            crop.x + crop.width - 1, crop.y, crop.y + crop.height - 1, x, y));
}

RayExplanation explain(const std::vector<VoxelLevel>& levels,
                       const std::vector<Material>& materials, const Camera& camera,
                       const std::vector<Light>& lights, const RenderParams& settings, int x, int y,
                       const SkinTracer* skins)
{
    requirePixel(settings, x, y, "explain");
    RenderParams params = settings;
    params.samples = 1; // so that soft lights are their middles
    const PictureTracer tracer(levels, materials, camera, lights, params, skins);
    RayExplanation e;
    e.x = x;
    e.y = y;
    const CameraRay ray = tracer.ray(x + 0.5, y + 0.5);
    e.origin = ray.origin;
    e.direction = ray.direction;
    const RayObserver observer = [&](const SeenSegment& seen) {
        e.intervals.push_back(explained(seen, levels, ray.direction));
    };
    Integrator::Scratch plain, observed;
    observed.observer = &observer;
    plain.sample = observed.sample = sampleNumber(params, x, y, 0);
    std::optional<SeenSkin> skin;
    const RaySample sample = tracer.trace(ray, plain, &skin);
    e.transmittance = sample.transmittance;
    e.haze = sample.haze;
    if (skin) e.skin = explained(*skin, lights, *skins);
    if (shinesNowhere(params, lights)) {
        RenderParams endless = params;
        endless.cutoff = 0;
        endless.shadows = Shadows::none;
        PictureTracer(levels, materials, camera, lights, endless, skins).trace(ray, observed);
        dropBehind(skin ? skin->transmittance : e.transmittance, e.intervals);
    } else tracer.trace(ray, observed);
    addSums(params, lights.size(), plain.haze, e);
    return e;
}

} // namespace volcomp
