// SPDX-License-Identifier: Apache-2.0
#include "tools/truth/paths.h"

#include <algorithm>
#include <cmath>

#include "volcomp/base/across.h"
#include "volcomp/base/interval.h"

namespace volcomp {
namespace {

constexpr double kClosest = 1e-6; ///< least distance to a light, world units
/// Paths that carry less go on with a chance: nothing is lost in the mean, and dark ones end. What
/// late scatterings add is little against the noise of the first ones, so this pays.
constexpr double kFaint = 0.5;
/// Uses of random numbers at a vertex; a light has kLights + its number.
enum Use { kDirection, kSide, kLights };

double fraction(double x) { return x - std::floor(x); }

double largest(const Vec3d& v) { return std::max({v[0], v[1], v[2]}); }

/// A place on the unit disc across `n`.
Vec3d onDisc(const Vec3d& n, const std::array<double, 2>& u)
{
    const auto [x, y] = across(n);
    const double r = std::sqrt(u[0]), angle = 2 * kPi * u[1];
    return r * std::cos(angle) * x + r * std::sin(angle) * y;
}

/// A direction within the angle of that cosine from `axis`, evenly over the solid angle.
Vec3d inCone(const Vec3d& axis, double cosine, const std::array<double, 2>& u)
{
    const double z = 1 - u[0] * (1 - cosine);
    return z * axis + std::sqrt(std::max(0.0, 1 - z * z)) * onDisc(axis, {1.0, u[1]});
}

/// A ball that is as bright everywhere: what it brings to a surface that it stands wholly above is
/// what a point in its middle would.
Illumination illuminateBall(const Light& light, const Vec3d& p, const std::array<double, 2>& u)
{
    const Illumination middle = illuminate(light, p, kClosest);
    const double d = middle.distance, sine = std::min(1.0, light.radius / std::max(d, kClosest)),
                 cosine = d > light.radius ? std::sqrt(1 - sine * sine) : -1;
    Illumination in{inCone(middle.L, cosine, u), 0,
                    2 * (1 - cosine) / (light.radius * light.radius)};
    if (d <= light.radius) return in;
    const double along = d * in.L.dot(middle.L);
    in.distance =
        along - std::sqrt(std::max(0.0, along * along - d * d + light.radius * light.radius));
    return in;
}

/// What the lights send by one scattering at the hit.
Vec3d lightOf(const EmbreeScene& embree, const Scene& scene, const ExactHit& hit, const Vec3d& V,
              bool shadows, int depth, PathNumbers& numbers)
{
    const Material& material = *hit.material;
    Vec3d sum(0.0);
    for (std::size_t l = 0; l < scene.lights.size(); ++l) {
        const Light& light = scene.lights[l];
        const Illumination in = light.isSoft()
            ? illuminateSoft(light, hit.position, numbers.pair(depth, kLights + int(l)))
            : illuminate(light, hit.position, kClosest);
        if (!(in.weight > 0)) continue;
        Reflection f = hit.fibre ? reflectFibre(*hit.lobe, hit.direction, V, in.L)
                                 : reflectSurface(*hit.lobe, hit.direction, V, in.L);
        if (depth > 0) f.specular = 0;
        const Vec3d colour = f.colour(material, hit.colour);
        if (!(colour[0] + colour[1] + colour[2] > 0)) continue;
        if (shadows && embree.isOccluded(hit, in.L, in.distance)) continue;
        sum += colour * light.strength * in.weight;
    }
    return sum;
}

} // namespace

std::array<double, 2> PathNumbers::pair(int depth, int use)
{
    if (depth > 0) return {m_random.uniform(), m_random.uniform()};
    Random shift(hashKey(hashKey(m_key, 0), use));
    const double x = shift.uniform(), y = shift.uniform();
    return {fraction(x + m_sample * 0.75487766624669276),
            fraction(y + m_sample * 0.56984029099805327)};
}

Scattered scatter(const ExactHit& hit, const Vec3d& V, const std::array<double, 2>& a,
                  const std::array<double, 2>& b)
{
    const Material& material = *hit.material;
    if (hit.fibre) {
        // One coordinate of an even place on the disc is spread as sqrt(1 - z^2), the sine.
        const double z = std::sqrt(a[0]) * std::cos(2 * kPi * a[1]), angle = 2 * kPi * b[0],
                     sine = std::sqrt(std::max(0.0, 1 - z * z));
        const auto [x, y] = across(hit.direction);
        return {z * hit.direction + sine * (std::cos(angle) * x + std::sin(angle) * y),
                material.alpha * hit.colour};
    }
    const Vec3d N = hit.direction.dot(V) < 0 ? Vec3d(-hit.direction) : hit.direction;
    const Vec3d kappa = material.transmission;
    const double through = largest(kappa) / std::max(1e-300, material.alpha + largest(kappa));
    const bool passes = b[0] < through;
    const Vec3d flat = onDisc(N, a), up = std::sqrt(std::max(0.0, 1 - a[0])) * N;
    if (passes) return {flat - up, kappa * hit.colour / through};
    return {flat + up, material.alpha * hit.colour / (1 - through)};
}

Illumination illuminateSoft(const Light& light, const Vec3d& p, const std::array<double, 2>& u)
{
    if (light.kind == LightKind::directional)
        return {inCone(-light.direction, std::cos(0.5 * light.disc), u), kInfinity, 1};
    if (light.kind == LightKind::point) return illuminateBall(light, p, u);
    Light place = light;
    place.position += light.radius * onDisc(light.direction, u);
    return illuminate(place, p, kClosest);
}

Vec3d pathRadiance(const EmbreeScene& embree, const Scene& scene, ExactHit hit, Vec3d V,
                   const PathParams& params, PathNumbers& numbers)
{
    const RenderParams& render = scene.render;
    const bool has_sky = !render.dome.black() || render.ambient.lengthSqr() > 0;
    const auto sky = [&](const Vec3d& d) { return render.ambient + render.dome.radiance(d); };
    Vec3d sum(0.0), carried(1.0);
    for (int depth = 0;; ++depth) {
        sum += carried * lightOf(embree, scene, hit, V, params.shadows, depth, numbers);
        const bool last = depth + 1 >= params.bounces;
        if (last && !has_sky) return sum;
        const std::array<double, 2> a = numbers.pair(depth, kDirection),
                                    b = numbers.pair(depth, kSide);
        const Scattered on = scatter(hit, V, a, b);
        carried *= on.albedo;
        const double most = largest(carried);
        if (!(most > 0)) return sum;
        if (last) {
            if (params.shadows && embree.isOccluded(hit, on.direction, kInfinity)) return sum;
            return sum + carried * sky(on.direction);
        }
        if (most < kFaint) {
            if (numbers.number() * kFaint >= most) return sum;
            carried *= kFaint / most;
        }
        const std::optional<ExactHit> next = embree.hitFrom(hit, on.direction);
        if (!next) return sum + carried * sky(on.direction);
        hit = *next;
        V = -on.direction;
    }
}

} // namespace volcomp
