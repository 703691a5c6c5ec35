// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/march/segment.h"

#include <cmath>

#include "volcomp/base/interval.h"
#include "volcomp/render/march/integration.h"
#include "volcomp/render/skin/skin_shadow.h"

namespace volcomp {
namespace {

struct WayToLight {
    Vec3d direction; ///< unit, grid axes; zero at the light itself
    double length;   ///< voxels; infinite for a directional light
};

WayToLight wayToLight(const Light& light, const Vec3d& p)
{
    if (light.kind == LightKind::directional) return {-light.direction, kInfinity};
    const Vec3d L = light.position - p;
    const double length = L.length();
    return {length > 0 ? L / length : L, length};
}

// The transmittance to a light, the same in the whole segment, where little depends on it or the
// sweep knows no better; empty if the light has to be looked at more closely. `weight` is the share
// of the pixel that shows the segment.
std::optional<double> approximateTransmittance(const MarchScene& scene, std::size_t light,
                                               const RaySegment& segment, double weight,
                                               LightOnRay& state)
{
    constexpr double kTrace = 0.001; // a segment of less weight takes the light of another
    constexpr double kReuse = 2;     // that is not farther away than this, voxels
    if (weight >= kTrace || !state.approximate
        || std::abs(segment.t - state.approximate->t) > kReuse) {
        const Vec3d middle = 0.5 * (segment.p_begin + segment.p_end);
        const WayToLight way = wayToLight(scene.grid_lights[light], middle);
        const auto found = scene.sweep->approximateTransmittance(light, segment.cell, middle,
                                                                 way.direction, way.length);
        if (!found) return {};
        state.approximate = {segment.t, found->value, found->fine};
    }
    const LightOnRay::Approximate& known = *state.approximate;
    if (known.fine && weight * known.transmittance >= ShadowSweep::kFineWeight) return {};
    return known.transmittance;
}

// The light that reaches the segment and is sent to its begin, over what Shading::from_light has.
// `opacity` is what the segment takes of the light that passes along the ray.
double lightOfSegment(const MarchScene& scene, std::size_t l, const RaySegment& segment,
                      double opacity, double weight, RayScratch& scratch)
{
    LightOnRay& state = scratch.lights[l];
    const std::optional<double> depth_at_begin = state.depth_at_end;
    state.depth_at_end.reset();
    if (scene.params.shadows == Shadows::none) return opacity;
    if (scene.params.integration == Integration::riemann)
        return segment.delta
            * std::exp(-depthToLight(scene, l, segment.cell, segment.p_begin, scratch.counts));
    if (scene.sweep)
        if (const auto passes = approximateTransmittance(scene, l, segment, weight, state))
            return opacity * *passes;
    const double a = depth_at_begin
        ? *depth_at_begin
        : depthToLight(scene, l, segment.cell, segment.p_begin, scratch.counts);
    const double b = depthToLight(scene, l, segment.cell, segment.p_end, scratch.counts);
    state.depth_at_end = b;
    return segment.delta * segmentLight(a, segment.delta + b - a);
}

} // namespace

void RayScratch::startRay(std::size_t light_count)
{
    lights.assign(light_count, {});
    last_end = -kInfinity;
    shading.keep_voxels = observer != nullptr;
}

void addSegment(const MarchScene& scene, const RaySegment& segment, RaySample& sample,
                RayScratch& scratch)
{
    ++scratch.counts.shaded_voxels;
    const Shading& shading = scratch.shading;
    const bool sums = scene.params.integration == Integration::riemann;
    if (sums) sample.transmittance *= std::exp(-segment.delta);
    const double opacity = sums ? segment.delta : -std::expm1(-segment.delta),
                 weight = sample.transmittance * opacity;
    std::optional<SeenSegment> seen;
    if (scratch.observer)
        seen.emplace(
            SeenSegment{scene, segment, shading, sample.transmittance, weight, {}, Vec3d(0.0)});
    if (scene.params.aovs) {
        sample.albedo += weight * shading.albedo;
        sample.normal += weight * shading.normal;
        sample.depth += weight * (0.5 * (segment.t + segment.end)) * scene.tree.voxelSize();
    }
    const bool adjoins = segment.t == scratch.last_end;
    for (std::size_t l = 0; l < scene.lights.size(); ++l) {
        const Vec3d& from_light = shading.from_light[l];
        if (!adjoins) scratch.lights[l].depth_at_end.reset();
        if (!(from_light[0] + from_light[1] + from_light[2] > 0)) {
            scratch.lights[l].depth_at_end.reset();
            continue;
        }
        // What the skins let through to the segment's middle.
        const double passes = scene.skin_shadow
            ? scene.skin_shadow->lightAt(l, 0.5 * (segment.p_begin + segment.p_end))
            : 1;
        if (!(passes > 0)) {
            if (seen) seen->lights.push_back({l, from_light, 0, Vec3d(0.0)});
            scratch.lights[l].depth_at_end.reset();
            continue;
        }
        const double light = passes * lightOfSegment(scene, l, segment, opacity, weight, scratch);
        const Vec3d radiance = sample.transmittance * (light * from_light);
        sample.radiance += radiance;
        if (scene.params.aovs) scratch.light_radiance[l] += radiance;
        if (seen) seen->lights.push_back({l, from_light, light / opacity, radiance});
    }
    const Vec3d ambient = weight * shading.ambient;
    sample.radiance += ambient;
    if (seen) {
        seen->ambient = ambient;
        (*scratch.observer)(*seen);
    }
    if (!sums) sample.transmittance *= std::exp(-segment.delta);
    scratch.last_end = segment.end;
}

double depthToLight(const MarchScene& scene, std::size_t light, const int* cell, const Vec3d& p,
                    RayCounts& counts)
{
    const WayToLight to = wayToLight(scene.grid_lights[light], p);
    if (!(to.length > 0)) return 0;
    double way = to.length, beyond = 0;
    const auto swept = scene.sweep
        ? scene.sweep->pathToLight(light, cell, p, to.direction, to.length)
        : std::nullopt;
    if (!swept) ++counts.shadow_rays;
    else {
        way = swept->march;
        beyond = swept->beyond;
        if (!(way > 0)) return beyond;
    }
    const Vec3d d_world = scene.tree.directionToWorld(to.direction);
    if (scene.dual)
        return beyond
            + depthAlong(scene, MarchRay(*scene.dual, p - Vec3d(0.5), to.direction, way), d_world);
    if (swept && scene.params.integration == Integration::exact) {
        const MarchRay r = scene.lights[light].kind == LightKind::directional
            ? scene.light_rays[light].from(p, way)
            : MarchRay(scene.tree, p, to.direction, way).from(p, way);
        return beyond + exactShortDepth(scene, r, cell, d_world);
    }
    return beyond + depthAlong(scene, MarchRay(scene.tree, p, to.direction, way), d_world);
}

double segmentLight(double a, double x)
{
    if (std::abs(x) < 1e-5) return std::exp(-a) * (1 - 0.5 * x);
    if (x > 0) return std::exp(-a) * -std::expm1(-x) / x;
    return std::exp(-a - x) * -std::expm1(x) / -x; // a + x >= 0: no overflow
}

} // namespace volcomp
