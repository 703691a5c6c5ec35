// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/skin/skin_dome.h"

#include <algorithm>
#include <cmath>

#include "volcomp/base/interval.h"
#include "volcomp/base/random.h"
#include "volcomp/render/march/integration.h"
#include "volcomp/render/skin/sky_path.h"

namespace volcomp {
namespace {

/// What passes the volume from outside to a place.
double throughVolume(const MarchScene& scene, const Vec3d& start, const Vec3d& d, RayCounts& counts)
{
    const VoxelTree& tree = scene.tree;
    if (tree.empty()) return 1;
    ++counts.shadow_rays;
    const Vec3d p = tree.toCorner(start), L = tree.directionToCorner(d);
    const MarchRay ray = scene.dual ? MarchRay(*scene.dual, p - Vec3d(0.5), L, kInfinity)
                                    : MarchRay(tree, p, L, kInfinity);
    return std::exp(-depthAlong(scene, ray, d));
}

/// What comes from the direction `d` to a place on a skin.
Vec3d radianceFrom(const MarchScene& scene, const SkinTracer& skins, const Vec3d& start,
                   const Vec3d& d, std::uint64_t key, RayCounts& counts)
{
    const bool blocked = scene.params.shadows != Shadows::none;
    if (blocked && scene.params.scattering == Scattering::multiple)
        return skyAlongPath(scene, skins, start, d, Random(key), counts);
    if (blocked && skins.isOccluded(start, d, kInfinity)) return Vec3d(0.0);
    const Vec3d sky = scene.params.ambient + scene.params.dome.softRadiance(d);
    return blocked ? throughVolume(scene, start, d, counts) * sky : sky;
}

/// Place `number` of a sequence that fills the unit square evenly, whatever its length (M. Roberts,
/// The unreasonable effectiveness of quasirandom sequences, 2018), moved by `key`.
std::pair<double, double> evenPlace(std::uint64_t key, int number)
{
    Random random(key);
    const double u = random.uniform() + 0.7548776662466927 * number,
                 v = random.uniform() + 0.5698402909980532 * number;
    return {u - std::floor(u), v - std::floor(v)};
}

} // namespace

int skinDirections(int samples) { return std::clamp((32 + samples - 1) / samples, 4, 8); }

DomeLight domeLight(const MarchScene& scene, const SkinTracer& skins, const SkinHit& hit,
                    const SampleNumber& sample, double weight, RayCounts& counts)
{
    const int most = skinDirections(scene.params.samples),
              directions = std::clamp(int(std::ceil(weight * most)), 1, most);
    const auto mean = [&](const SkinSide& side, std::uint64_t which) {
        const std::uint64_t pixel = hashKey(sample.pixel, which);
        Vec3d sum(0.0);
        for (int k = 0; k < directions; ++k) {
            const int number = sample.number * most + k;
            const auto [u, v] = evenPlace(pixel, number);
            sum += radianceFrom(scene, skins, side.start, cosineDirection(side, u, v),
                                hashKey(pixel, std::uint64_t(number) + 1), counts);
        }
        return sum / directions;
    };
    DomeLight light;
    if (scene.params.ambient == Vec3d(0.0) && scene.params.dome.black()) return light;
    light.front = mean(frontOf(hit), 0);
    if (skins.meshes()[hit.skin].material.transmission != Vec3d(0.0))
        light.back = mean(backOf(hit), 1);
    return light;
}

} // namespace volcomp
