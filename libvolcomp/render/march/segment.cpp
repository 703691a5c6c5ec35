// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/march/segment.h"

#include <algorithm>
#include <cmath>

#include "volcomp/base/interval.h"
#include "volcomp/render/march/bounces.h"
#include "volcomp/render/march/integration.h"
#include "volcomp/render/march/segment_light.h"
#include "volcomp/render/skin/skin_shadow.h"

namespace volcomp {

WayToLight wayToLight(const Light& light, const Vec3d& p)
{
    if (light.kind == LightKind::directional) return {-light.direction, kInfinity};
    const Vec3d L = light.position - p;
    const double length = L.length();
    return {length > 0 ? L / length : L, length};
}

void RayScratch::startRay(std::size_t light_count)
{
    lights.assign(light_count, {});
    light_sums.resize(std::max(light_sums.size(), light_count));
    shading.keep_voxels = observer != nullptr;
}

namespace {

// P in the segment's middle.
double closedAt(const MarchScene& scene, const RaySegment& segment)
{
    return scene.openness->closed(scene.tree.toWorld(0.5 * (segment.p_begin + segment.p_end)));
}

} // namespace

void addSegment(const MarchScene& scene, const RaySegment& segment, RaySample& sample,
                RayScratch& scratch)
{
    ++scratch.counts.shaded_voxels;
    const Shading& shading = scratch.shading;
    const bool sums = scene.params.integration == Integration::riemann;
    if (sums) sample.transmittance *= std::exp(-segment.delta);
    const double opacity = sums ? segment.delta : -std::expm1(-segment.delta),
                 weight = sample.transmittance * opacity;
    // The haze before the segment hides a part of it and glows as much instead (MODEL section 3).
    const double clear = scene.params.haze.none()
        ? 1
        : scratch.haze.transmittance(0.5 * (segment.t + segment.end) * scene.tree.voxelSize());
    sample.haze += weight * (1 - clear) * scratch.haze.colour();
    std::optional<SeenSegment> seen;
    if (scratch.observer)
        seen.emplace(
            SeenSegment{scene, segment, shading, sample.transmittance, weight, {}, Vec3d(0.0)});
    if (scene.params.aovs) {
        sample.albedo += weight * shading.albedo;
        sample.normal += weight * shading.normal;
        sample.depth += weight * (0.5 * (segment.t + segment.end)) * scene.tree.voxelSize();
    }
    const bool bounces = scene.bounces();
    const double closed = bounces ? closedAt(scene, segment) : 0;
    for (std::size_t l = 0; l < scene.lights.size(); ++l) {
        const Vec3d& from_light = shading.from_light[l];
        const bool reflects = from_light[0] + from_light[1] + from_light[2] > 0;
        const bool scatters = bounces && shading.arriving[l] != Vec3d(0.0);
        if (!reflects && !scatters) continue;
        // What the skins let through to the segment's middle.
        const double passes = scene.skin_shadow ? scene.skin_shadow->lightAt(
                                  scene.shadow_of[l], 0.5 * (segment.p_begin + segment.p_end))
                                                : 1;
        const Vec3d offered = weight * clear * from_light;
        if (!(passes > 0)) {
            scratch.addLight(l, offered, Vec3d(0.0), Vec3d(0.0));
            if (seen) seen->lights.push_back({l, from_light, 0, Vec3d(0.0)});
            continue;
        }
        const SegmentLight found = reflects
            ? lightOfSegment(scene, l, segment, opacity, sample, scratch)
            : SegmentLight{0, depthOfSegment(scene, l, segment, weight, scratch)};
        const double light = passes * found.light;
        const Vec3d radiance = clear * sample.transmittance * (light * from_light),
                    scattered = scatters ? clear * weight * passes * shading.arriving[l]
                * lightOfBounces(shading.bounced, closed, found.depth)
                                         : Vec3d(0.0);
        sample.radiance += radiance + scattered;
        scratch.addLight(l, offered, radiance, scattered);
        if (scene.params.aovs) scratch.light_radiance[l] += radiance + scattered;
        if (seen) seen->lights.push_back({l, from_light, light / opacity, radiance, scattered});
    }
    const Vec3d ambient = weight * clear * shading.ambient;
    sample.radiance += ambient;
    sample.ambient += ambient;
    if (seen) {
        seen->ambient = ambient;
        (*scratch.observer)(*seen);
    }
    if (!sums) sample.transmittance *= std::exp(-segment.delta);
}

namespace {

// The optical depth with the box filter along a short ray that begins in voxel `cell` or on its
// faces.
double shortDepth(const MarchScene& scene, std::size_t light, const int* cell, const Vec3d& p,
                  const Vec3d& L, double way, const Vec3d& d_world)
{
    const MarchRay r = scene.lights[light].kind == LightKind::directional
        ? scene.light_rays[light].from(p, way)
        : MarchRay(scene.tree, p, L, way).from(p, way);
    return exactShortDepth(scene, r, cell, d_world);
}

// The depth with the trilinear filter, of which the sweep knows what lies beyond a plane, with the
// box filter. The plane lies between two layers of voxel centres. From the next layer of centres on
// the two filters add up to the same, so the way is marched to there, and what the box filter has
// between the two is taken away.
double trilinearSweptDepth(const MarchScene& scene, std::size_t light, const Vec3d& p,
                           const WayToLight& to, const ShadowSweep::Path& swept,
                           const Vec3d& d_world)
{
    const Vec3d& L = to.direction;
    const double to_centres = 0.5 / std::abs(L[largestAxis(L)]),
                 more = std::min(to_centres, to.length - swept.march);
    double beyond = swept.beyond;
    if (more > 0 && beyond < scene.darkestToLight()) {
        // A little behind the plane, so that rounding does not choose the voxel before it.
        const Vec3d start = p + (swept.march + 1e-9) * L;
        int cell[3];
        for (int a = 0; a < 3; ++a) cell[a] = int(std::floor(start[a]));
        beyond -= shortDepth(scene, light, cell, start, L, more, d_world);
    }
    return std::max(0.0, beyond)
        + depthAlong(scene, MarchRay(*scene.dual, p - Vec3d(0.5), L, swept.march + more), d_world);
}

} // namespace

double depthToLight(const MarchScene& scene, std::size_t light, const int* cell, const Vec3d& p,
                    RayCounts& counts)
{
    const WayToLight to = wayToLight(scene.grid_lights[light], p);
    if (!(to.length > 0)) return 0;
    const auto swept = scene.sweep
        ? scene.sweep->pathToLight(scene.shadow_of[light], cell, p, to.direction, to.length,
                                   scene.dual != nullptr)
        : std::nullopt;
    if (!swept) ++counts.shadow_rays;
    const Vec3d d_world = scene.tree.directionToWorld(to.direction);
    if (swept && scene.params.integration == Integration::exact) {
        if (scene.dual) return trilinearSweptDepth(scene, light, p, to, *swept, d_world);
        return swept->march > 0
            ? swept->beyond + shortDepth(scene, light, cell, p, to.direction, swept->march, d_world)
            : swept->beyond;
    }
    const double way = swept ? swept->march : to.length, beyond = swept ? swept->beyond : 0;
    if (!(way > 0)) return beyond;
    return beyond
        + depthAlong(scene,
                     scene.dual ? MarchRay(*scene.dual, p - Vec3d(0.5), to.direction, way)
                                : MarchRay(scene.tree, p, to.direction, way),
                     d_world);
}

double depthFromStart(const MarchScene& scene, std::size_t light, double start, const int* cell,
                      const Vec3d& p, RayCounts& counts)
{
    if (start == 0) return depthToLight(scene, light, cell, p, counts);
    const WayToLight to = wayToLight(scene.grid_lights[light], p);
    if (!(to.length > start)) return 0;
    const Vec3d moved = p + start * to.direction;
    const int there[3] = {floorToInt(moved[0]), floorToInt(moved[1]), floorToInt(moved[2])};
    return depthToLight(scene, light, there, moved, counts);
}

double segmentLight(double a, double x)
{
    if (std::abs(x) < 1e-5) return std::exp(-a) * (1 - 0.5 * x);
    if (x > 0) return std::exp(-a) * -std::expm1(-x) / x;
    return std::exp(-a - x) * -std::expm1(x) / -x; // a + x >= 0: no overflow
}

} // namespace volcomp
