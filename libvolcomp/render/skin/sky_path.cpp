// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/skin/sky_path.h"

#include <algorithm>
#include <cmath>

#include "volcomp/base/across.h"
#include "volcomp/base/interval.h"
#include "volcomp/render/march/particle_on_ray.h"

namespace volcomp {
namespace {

constexpr int kMostBounces = 1000; ///< hardly a path comes so far

double greatest(const Vec3d& v) { return std::max({v[0], v[1], v[2]}); }

Vec3d cosineDirection(const Vec3d& n, double u, double v)
{
    const auto [a, b] = across(n);
    const double r = std::sqrt(u), angle = 2 * kPi * v;
    return r * std::cos(angle) * a + r * std::sin(angle) * b + std::sqrt(1 - u) * n;
}

Vec3d cosineDirection(const Vec3d& n, Random& random)
{
    const double u = random.uniform(), v = random.uniform();
    return cosineDirection(n, u, v);
}

Vec3d evenDirection(Random& random)
{
    const double z = random.symmetric(), r = std::sqrt(1 - z * z),
                 angle = 2 * kPi * random.uniform();
    return {r * std::cos(angle), r * std::sin(angle), z};
}

class SkyPath {
public:
    SkyPath(const MarchScene& scene, const SkinTracer& skins, Random random, RayCounts& counts)
        : m_scene(scene), m_skins(skins), m_random(random), m_counts(counts)
    {
    }

    Vec3d follow(const Vec3d& start, const Vec3d& direction)
    {
        m_p = start;
        m_d = direction;
        for (m_bounce = 0; m_bounce < kMostBounces; ++m_bounce) {
            const auto hit = m_skins.hit(m_p, m_d);
            if (const auto particle = nextParticle(hit ? hit->distance : kInfinity)) {
                if (!leaveParticle(*particle)) break;
            } else if (hit) {
                if (!leaveSkin(*hit)) break;
            } else
                return m_share * (m_scene.params.ambient + m_scene.params.dome.softRadiance(m_d));
        }
        return Vec3d(0.0);
    }

private:
    std::optional<ParticleOnRay> nextParticle(double distance)
    {
        const VoxelTree& tree = m_scene.tree;
        if (tree.empty()) return std::nullopt;
        ++m_counts.shadow_rays;
        const MarchRay ray(tree, tree.toCorner(m_p), tree.directionToCorner(m_d),
                           distance / tree.voxelSize());
        return particleAtDepth(m_scene, ray, m_d, -std::log(1 - m_random.uniform()));
    }

    /// Chooses between reflection and transmission, and whether the path goes on at all: if it
    /// does, it counts more for those that do not.
    enum class Way { ends, back, through };
    Way choose(const Vec3d& reflects, const Vec3d& transmits)
    {
        const double back = greatest(reflects), all = back + greatest(transmits);
        const double goes_on = m_bounce == 0 ? 1 : std::min(1.0, all), chance = m_random.uniform();
        if (!(all > 0) || !(chance < goes_on)) return Way::ends;
        const bool through = chance >= goes_on * back / all;
        m_share *= (through ? transmits / greatest(transmits) : reflects / back) * (all / goes_on);
        return through ? Way::through : Way::back;
    }

    bool leaveSkin(const SkinHit& hit)
    {
        const Material& material = m_skins.meshes()[hit.skin].material;
        const Way way = choose(material.alpha * hit.colour, material.transmission * hit.colour);
        const SkinSide side = way == Way::through ? backOf(hit) : frontOf(hit);
        const double u = m_random.uniform(), v = m_random.uniform();
        m_p = side.start;
        m_d = volcomp::cosineDirection(side, u, v);
        return way != Way::ends;
    }

    bool leaveParticle(const ParticleOnRay& at)
    {
        const VoxelTree& tree = m_scene.tree;
        const auto factor = [&](const VoxelContent& c) {
            return m_scene.directed ? tree.directionFactor(c, m_d) : 1.0;
        };
        double total = 0;
        tree.contents(at.voxel.leaf, at.voxel.voxel,
                      [&](const VoxelContent& c) { total += c.density * factor(c); });
        double chosen = total * m_random.uniform();
        bool goes_on = false, found = false;
        Vec3d d(0.0);
        tree.contents(at.voxel.leaf, at.voxel.voxel, [&](const VoxelContent& c) {
            chosen -= c.density * factor(c);
            if (found || chosen > 0) return;
            found = true;
            const Material& m = m_scene.materials[c.part];
            const Way way = choose(m.alpha * c.colour, m.transmission * c.colour);
            goes_on = way != Way::ends;
            if (goes_on) d = leaving(c, m.kind, way == Way::through);
        });
        m_p = tree.origin() + tree.directionToWorld(at.p * tree.voxelSize());
        m_d = d;
        return goes_on;
    }

    /// The direction in which light that came along m_d leaves a particle.
    Vec3d leaving(const VoxelContent& c, MaterialKind kind, bool through)
    {
        if (!c.directed) return evenDirection(m_random);
        const double spread = spreadOf(c.spread_code), s2 = spread * spread;
        if (kind == MaterialKind::fibre)
            for (;;) { // with the sine of its angle from the tangent
                const Vec3d d = evenDirection(m_random);
                const double cosine = c.direction.dot(d);
                const double sine_square =
                    ((1 - cosine * cosine) * (1 - s2) + 2 * s2) / (1 + 2 * s2);
                if (m_random.uniform() < std::sqrt(sine_square)) return d;
            }
        Vec3d n = c.direction; // a share of the normals lies evenly; it meets those that face it
        if (m_random.uniform() < 3 * s2 / (1 + 2 * s2)) n = cosineDirection(-m_d, m_random);
        if ((n.dot(m_d) < 0) == through) n = -n;
        return cosineDirection(n, m_random);
    }

    const MarchScene& m_scene;
    const SkinTracer& m_skins;
    Random m_random;
    RayCounts& m_counts;
    Vec3d m_p{0.0}, m_d{0.0}; ///< where the path is and goes, world
    Vec3d m_share{1.0};       ///< of the sky that it brings
    int m_bounce = 0;
};

} // namespace

Vec3d cosineDirection(const SkinSide& side, double u, double v)
{
    const Vec3d d = cosineDirection(side.normal, u, v);
    const double above = d.dot(side.face);
    return above < 0 ? d - 2 * above * side.face : d;
}

Vec3d skyAlongPath(const MarchScene& scene, const SkinTracer& skins, Vec3d start, Vec3d d,
                   Random random, RayCounts& counts)
{
    return SkyPath(scene, skins, random, counts).follow(start, d);
}

} // namespace volcomp
