// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/skin/skin_dome.h"

#include <algorithm>
#include <cmath>

#include "volcomp/base/random.h"
#include "volcomp/render/march/integration.h"

namespace volcomp {
namespace {

constexpr int kMostBounces = 32; ///< of a path; few come so far

double greatest(const Vec3d& v) { return std::max({v[0], v[1], v[2]}); }

/// One side of a skin's hit.
struct Side {
    Vec3d start, face, normal;
};
Side frontOf(const SkinHit& hit) { return {hit.start, hit.face, hit.normal}; }
Side backOf(const SkinHit& hit) { return {hit.back_start, -hit.face, -hit.normal}; }

/// The direction of a cosine's distribution at (u, v), both 0 to 1. What is below the triangle,
/// where its normal is not the interpolated one, is turned above it.
Vec3d cosineDirection(const Side& side, double u, double v)
{
    const Vec3d& n = side.normal;
    const Vec3d a = n.cross(std::abs(n[0]) < 0.6 ? Vec3d(1, 0, 0) : Vec3d(0, 1, 0)).unit(),
                b = n.cross(a);
    const double r = std::sqrt(u), angle = 2 * kPi * v;
    const Vec3d d = r * std::cos(angle) * a + r * std::sin(angle) * b + std::sqrt(1 - u) * n;
    const double above = d.dot(side.face);
    return above < 0 ? d - 2 * above * side.face : d;
}

class SkinSurroundings {
public:
    SkinSurroundings(const MarchScene& scene, const SkinTracer& skins, RayCounts& counts)
        : m_scene(scene), m_skins(skins), m_blocks(scene.params.shadows != Shadows::none),
          m_bounces(scene.params.scattering == Scattering::multiple), m_counts(counts)
    {
    }

    /// What comes from the direction `d` to a place on a skin.
    Vec3d radiance(Vec3d start, Vec3d d, std::uint64_t key)
    {
        if (!m_blocks) return sky(d);
        if (!m_bounces)
            return m_skins.isOccluded(start, d, kInfinity)
                ? Vec3d(0.0)
                : throughVolume(start, d, kInfinity) * sky(d);
        Random random(key);
        Vec3d share(1.0);
        for (int bounce = 0; bounce < kMostBounces; ++bounce) {
            const auto hit = m_skins.hit(start, d);
            share *= throughVolume(start, d, hit ? hit->distance : kInfinity);
            if (!hit) return share * sky(d);
            const Material& material = m_skins.meshes()[hit->skin].material;
            const Vec3d reflects = material.alpha * hit->colour,
                        transmits = material.transmission * hit->colour;
            const double all = greatest(reflects) + greatest(transmits);
            // One of the two sides, and later only some of the paths, which then count more.
            const double goes_on = bounce == 0 ? 1 : std::min(1.0, all), chance = random.uniform();
            if (!(all > 0)) break;
            if (!(chance < goes_on)) break;
            const bool passes = chance >= goes_on * greatest(reflects) / all;
            const double part = greatest(passes ? transmits : reflects) / all;
            share *= (passes ? transmits : reflects) / (goes_on * part);
            const Side side = passes ? backOf(*hit) : frontOf(*hit);
            start = side.start;
            const double u = random.uniform(), v = random.uniform();
            d = cosineDirection(side, u, v);
        }
        return Vec3d(0.0);
    }

private:
    double throughVolume(const Vec3d& start, const Vec3d& d, double distance)
    {
        const VoxelTree& tree = m_scene.tree;
        if (tree.empty()) return 1;
        ++m_counts.shadow_rays;
        const Vec3d p = tree.toCorner(start), L = tree.directionToCorner(d);
        const double length = distance / tree.voxelSize();
        const MarchRay ray = m_scene.dual ? MarchRay(*m_scene.dual, p - Vec3d(0.5), L, length)
                                          : MarchRay(tree, p, L, length);
        return std::exp(-depthAlong(m_scene, ray, d));
    }
    Vec3d sky(const Vec3d& d) const
    {
        return m_scene.params.ambient + m_scene.params.dome.softRadiance(d);
    }

    const MarchScene& m_scene;
    const SkinTracer& m_skins;
    const bool m_blocks, m_bounces;
    RayCounts& m_counts;
};

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
    SkinSurroundings around(scene, skins, counts);
    const int most = skinDirections(scene.params.samples),
              directions = std::clamp(int(std::ceil(weight * most)), 1, most);
    const auto mean = [&](const Side& side, std::uint64_t which) {
        const std::uint64_t pixel = hashKey(sample.pixel, which);
        Vec3d sum(0.0);
        for (int k = 0; k < directions; ++k) {
            const int number = sample.number * most + k;
            const auto [u, v] = evenPlace(pixel, number);
            sum += around.radiance(side.start, cosineDirection(side, u, v),
                                   hashKey(pixel, std::uint64_t(number) + 1));
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
