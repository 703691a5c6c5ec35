// SPDX-License-Identifier: Apache-2.0
#include "tools/truth/light_path.h"

#include <algorithm>
#include <cmath>

namespace volcomp {
namespace {

constexpr double kClosest = 1e-6; ///< least distance to a light, world units

/// Two unit vectors across a unit vector and each other (Duff and others, Building an Orthonormal
/// Basis, Revisited, 2017).
struct Across {
    Vec3d u, v;

    explicit Across(const Vec3d& n)
    {
        const double sign = std::copysign(1.0, n[2]), a = -1 / (sign + n[2]), b = n[0] * n[1] * a;
        u = {1 + sign * n[0] * n[0] * a, sign * b, -sign * n[0]};
        v = {b, sign + n[1] * n[1] * a, -n[1]};
    }
    Vec3d at(double radius, double turn) const
    {
        return radius * (std::cos(turn) * u + std::sin(turn) * v);
    }
};

/// The normal of a surface on the side of V.
Vec3d seenNormal(const ExactHit& hit, const Vec3d& V)
{
    return hit.direction.dot(V) < 0 ? -hit.direction : hit.direction;
}

/// The hit as rays leave it on the side of `d`; a hit starts on that of V.
ExactHit leftTowards(const ExactHit& hit, const Vec3d& V, const Vec3d& d)
{
    ExactHit left = hit;
    if (!hit.fibre && seenNormal(hit, V).dot(d) < 0) left.start = 2 * hit.position - hit.start;
    return left;
}

/// What the lights send from the hit to the eye.
Vec3d fromLights(const EmbreeScene& embree, const Scene& scene, const ExactHit& hit, const Vec3d& V,
                 bool shadows, bool specular, Random& random)
{
    Vec3d sum(0.0);
    for (const Light& scene_light : scene.lights) {
        const Light light = drawnLight(scene_light, hit.position, random);
        const Illumination in = illuminate(light, hit.position, kClosest);
        if (!(in.weight > 0)) continue;
        Reflection f = hit.fibre ? reflectFibre(*hit.lobe, hit.direction, V, in.L)
                                 : reflectSurface(*hit.lobe, hit.direction, V, in.L);
        if (!specular) f.specular = 0;
        const Vec3d colour = f.colour(*hit.material, hit.colour);
        if (!(colour[0] + colour[1] + colour[2] > 0)) continue;
        if (shadows && embree.isOccluded(leftTowards(hit, V, in.L), in.L, in.distance)) continue;
        sum += colour * light.strength * in.weight;
    }
    return sum;
}

/// A direction in which a path goes on, and the share of the light from there that it stands for.
struct Onward {
    Vec3d direction, weight;
};

Onward drawnFromFibre(const ExactHit& hit, Random& random)
{
    // The sine of the angle from the tangent has the density (2 / pi) sin^2: by rejection.
    double angle, sine;
    do {
        angle = kPi * random.uniform();
        sine = std::sin(angle);
    } while (random.uniform() > sine * sine);
    const Across across(hit.direction);
    return {std::cos(angle) * hit.direction + across.at(sine, 2 * kPi * random.uniform()),
            hit.material->alpha * hit.colour};
}

Onward drawnFromSurface(const ExactHit& hit, const Vec3d& V, Random& random)
{
    const Vec3d& through = hit.material->transmission;
    const double share = (through[0] + through[1] + through[2]) / 3,
                 chance = share > 0 ? share / (hit.material->alpha + share) : 0;
    const bool passes = random.uniform() < chance;
    const Vec3d n = passes ? -seenNormal(hit, V) : seenNormal(hit, V);
    const double u = random.uniform();
    const Vec3d direction =
        (std::sqrt(1 - u) * n + Across(n).at(std::sqrt(u), 2 * kPi * random.uniform())).unit();
    return {direction,
            passes ? through * hit.colour / chance
                   : hit.material->alpha / (1 - chance) * hit.colour};
}

} // namespace

Light drawnLight(const Light& light, const Vec3d& p, Random& random)
{
    const bool parallel = light.kind == LightKind::directional;
    if (!((parallel ? light.disc : light.radius) > 0)) return light;
    Light drawn = light;
    const double u = random.uniform(), turn = 2 * kPi * random.uniform();
    if (parallel) { // evenly over the solid angle
        const double cosine = 1 - u * (1 - std::cos(light.disc / 2));
        drawn.direction =
            (cosine * light.direction
             + Across(light.direction).at(std::sqrt(std::max(0.0, 1 - cosine * cosine)), turn))
                .unit();
        return drawn;
    }
    const Vec3d way = light.position - p;
    const Vec3d axis = light.kind != LightKind::point ? light.direction
        : way.length() > 0                            ? way.unit()
                                                      : Vec3d(0, 1, 0);
    drawn.position += Across(axis).at(light.radius * std::sqrt(u), turn);
    return drawn;
}

Vec3d pathRadiance(const EmbreeScene& embree, const Scene& scene, ExactHit hit, Vec3d V,
                   int bounces, bool shadows, Random random)
{
    constexpr int kWhole = 4; // paths are not ended before
    const RenderParams& render = scene.render;
    const bool sky = !render.dome.black() || render.ambient.lengthSqr() > 0;
    Vec3d sum(0.0), passes(1.0);
    for (int bounce = 1;; ++bounce) {
        sum += passes * fromLights(embree, scene, hit, V, shadows, bounce == 1, random);
        if (bounce == bounces && !sky) return sum;
        const Onward on =
            hit.fibre ? drawnFromFibre(hit, random) : drawnFromSurface(hit, V, random);
        passes *= on.weight;
        if (bounce >= kWhole) {
            const double chance = std::min(1.0, std::max({passes[0], passes[1], passes[2]}));
            if (!(random.uniform() < chance)) return sum;
            passes /= chance;
        } else if (passes == Vec3d(0.0)) return sum;
        const auto next = embree.hit(leftTowards(hit, V, on.direction), on.direction);
        if (!next) return sum + passes * (render.ambient + render.dome.radiance(on.direction));
        if (bounce == bounces) return sum;
        hit = *next;
        V = -on.direction;
    }
}

} // namespace volcomp
