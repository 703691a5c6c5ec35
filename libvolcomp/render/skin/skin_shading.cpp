// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/skin/skin_shading.h"

#include <cmath>

#include "volcomp/base/interval.h"
#include "volcomp/base/random.h"
#include "volcomp/render/march/bounces.h"
#include "volcomp/render/march/integration.h"
#include "volcomp/render/skin/skin_dome.h"
#include "volcomp/view/soft_light.h"

namespace volcomp {
namespace {

constexpr double kClosest = 1e-6; ///< least distance to a light, world units

/// A place on a skin as the volume has it.
struct PlaceInGrid {
    Vec3d p; ///< corner coordinates
    int cell[3] = {0, 0, 0};
    bool in_bounds = true; ///< of the tree; else there is no cell

    PlaceInGrid(const VoxelTree& tree, const Vec3d& world) : p(tree.toCorner(world))
    {
        const openvdb::CoordBBox& box = tree.bounds();
        for (int a = 0; a < 3; ++a)
            in_bounds = in_bounds && p[a] >= box.min()[a] && p[a] < box.max()[a] + 1.0;
        for (int a = 0; in_bounds && a < 3; ++a) cell[a] = int(std::floor(p[a]));
        in_bounds = in_bounds && !tree.empty();
    }
};

/// Where a ray to the light goes: to a place at random of a soft light's share.
Illumination towards(const Light& light, std::size_t l, const SkinHit& hit,
                     const SampleNumber& sample)
{
    Random random(hashKey(hashKey(sample.pixel, l), std::uint64_t(sample.number)));
    const double u = random.uniform(), v = random.uniform();
    return illuminate(movedInShare(light, u, v), hit.position, kClosest);
}

/// What the volume lets through to a light. `weight` is the share of the pixel that shows the
/// place.
double throughVolume(const MarchScene& scene, std::size_t l, const PlaceInGrid& at,
                     const Illumination& in, double weight, RayCounts& counts)
{
    if (scene.tree.empty()) return 1;
    const Vec3d L = scene.tree.directionToCorner(in.L);
    const double length = in.distance / scene.tree.voxelSize();
    if (!at.in_bounds) { // which the sweep does not know
        ++counts.shadow_rays;
        const MarchRay ray = scene.dual ? MarchRay(*scene.dual, at.p - Vec3d(0.5), L, length)
                                        : MarchRay(scene.tree, at.p, L, length);
        return std::exp(-depthAlong(scene, ray, in.L));
    }
    if (scene.sweep)
        if (const auto rough =
                scene.sweep->approximateTransmittance(scene.shadow_of[l], at.cell, at.p, L, length);
            rough && weight * rough->value < ShadowSweep::kFineWeight)
            return rough->value;
    return std::exp(-depthToLight(scene, l, at.cell, at.p, counts));
}

/// P of the volume alone for light that leaves a skin: over its own side, by the cosine.
double closedAbove(const Openness& openness, const SkinHit& hit)
{
    const Openness::ByDirection open = openness.openWithoutSkins(hit.start);
    double all = 0, closed = 0;
    for (int d = 0; d < Openness::kDirections; ++d) {
        const double w =
            Openness::weights()[d] * std::max(0.0, hit.normal.dot(openness.directions()[d]));
        all += w;
        closed += w * (1 - open[d]);
    }
    return closed / all;
}

/// How much of the light that is scattered more than once a skin gets by the cosine of the light:
/// all of it but where the light grazes, so that it fades out before the skin stands in its own
/// light, whose border follows the triangles.
double shareOfBounces(double cosine, bool transmits)
{
    constexpr double kGrazes = 0.25;
    return std::min(1.0, std::max(0.0, transmits ? std::abs(cosine) : cosine) / kGrazes);
}

} // namespace

void addSkin(const MarchScene& scene, const SkinTracer& skins, const SkinHit& hit, const Vec3d& V,
             RaySample& sample, RayScratch& scratch, std::optional<SeenSkin>* seen)
{
    const double weight = sample.transmittance;
    sample.transmittance = 0;
    if (!(weight > 0) || weight < scene.params.cutoff) return;
    const double clear = scratch.haze.transmittance(hit.distance);
    const Material& material = skins.meshes()[hit.skin].material;
    const Lobe lobe = makeLobe(material);
    const DomeLight around = domeLight(scene, skins, hit, scratch.sample, weight, scratch.counts);
    const Vec3d albedo = material.alpha * hit.colour,
                ambient = weight * clear
        * (albedo * around.front + material.transmission * hit.colour * around.back);
    sample.radiance += ambient;
    sample.ambient += ambient;
    sample.haze += weight * (1 - clear) * scratch.haze.colour();
    if (seen) seen->emplace(SeenSkin{hit, weight, {}, ambient});
    if (scene.params.aovs) {
        sample.albedo += weight * albedo;
        sample.normal += weight * hit.normal;
        sample.depth += weight * hit.distance;
    }
    const bool transmits = material.transmission != Vec3d(0.0);
    const bool shadows = scene.params.shadows != Shadows::none;
    const PlaceInGrid at(scene.tree, hit.position);
    const double closed = scene.bounces() ? closedAbove(*scene.openness, hit) : 0;
    for (std::size_t l = 0; l < scene.lights.size(); ++l) {
        const Illumination in = illuminate(scene.lights[l], hit.position, kClosest);
        if (!(in.weight > 0)) continue;
        const Reflection f = reflectSurface(lobe, hit.normal, V, in.L);
        const Vec3d arriving = scene.lights[l].strength * in.weight,
                    reflected = f.colour(material, hit.colour) * arriving;
        const double cosine = in.L.dot(hit.normal), share = shareOfBounces(cosine, transmits);
        if (!(reflected[0] + reflected[1] + reflected[2] > 0) && !(closed * share > 0)) continue;
        const Vec3d& start = transmits && cosine < 0 ? hit.back_start : hit.start;
        double passes = 1;
        if (shadows) {
            const Illumination way = towards(scene.lights[l], l, hit, scratch.sample);
            // The sweep knows the middle of the share alone.
            passes = skins.isOccluded(start, way.L, way.distance)
                ? 0
                : throughVolume(scene, l, at, at.in_bounds ? in : way, weight, scratch.counts);
        }
        const double depth = passes > 0 ? -std::log(passes) : kInfinity;
        const Vec3d offered = weight * clear * reflected,
                    radiance = weight * clear * passes * reflected,
                    scattered =
                        weight * clear * share * arriving * lightOfBounces(albedo, closed, depth);
        sample.radiance += radiance + scattered;
        scratch.addLight(l, offered, radiance, scattered);
        if (scene.params.aovs) scratch.light_radiance[l] += radiance + scattered;
        if (seen) (*seen)->lights.push_back({l, reflected, passes, radiance, scattered});
    }
}

} // namespace volcomp
