// SPDX-License-Identifier: Apache-2.0
#include "volcomp/view/soft_light.h"

#include <algorithm>
#include <cmath>

#include "volcomp/base/across.h"

namespace volcomp {
namespace {

constexpr double kGolden = 0.61803398874989484820, kPlastic = 0.75487766624669276005;

double fraction(double x) { return x - std::floor(x); }

/// A place on the unit disc, by the share of the area that lies nearer to its middle.
struct OnDisc {
    double area, angle;
};
/// That of pair `i` of `count` lights: rings of the same area, turned by the golden section of half
/// a turn.
OnDisc onDisc(int i, int count)
{
    constexpr double kTurn = 0.1; // so that no pair lies along an axis
    return {(2 * i + 1 + count % 2) / double(count), kPi * fraction(kTurn + i * kGolden)};
}

/// The radius in the unit ball inside which lies the share `q` of what looks like an evenly bright
/// disc from all sides: a density of 1 / sqrt(1 - r^2) (Abel's integral), of which the share
/// 2 (asin r - r sqrt(1 - r^2)) / pi lies inside r.
double ballRadius(double q)
{
    double low = 0, high = 1;
    for (int i = 0; i < 50; ++i) {
        const double r = 0.5 * (low + high);
        (2 / kPi * (std::asin(r) - r * std::sqrt(1 - r * r)) < q ? low : high) = r;
    }
    return low;
}

/// The place of pair `i` of `count` lights in the unit ball: a spiral over half a sphere, with the
/// shells of the same content in another order.
Vec3d inBall(int i, int count)
{
    const int pairs = count / 2;
    int shell = 0;
    for (int k = 0; k < pairs; ++k) shell += fraction(k * kPlastic) < fraction(i * kPlastic);
    const double z = (i + 0.5) / pairs, angle = 2 * kPi * fraction(i * kGolden),
                 flat = std::sqrt(1 - z * z);
    return ballRadius((2 * shell + 1 + count % 2) / double(count))
        * Vec3d(flat * std::cos(angle), z, flat * std::sin(angle));
}

/// The light moved to pair `i`, on one side or, with `side` = -1, the other.
Light moved(const Light& light, int i, int count, double side)
{
    Light result = light;
    if (light.kind == LightKind::point) {
        result.position += side * light.radius * inBall(i, count);
        return result;
    }
    const OnDisc at = onDisc(i, count);
    const auto [b, c] = across(light.direction);
    const Vec3d sideways = side * (std::cos(at.angle) * b + std::sin(at.angle) * c);
    if (light.kind == LightKind::directional) {
        const double cosine = 1 - at.area * (1 - std::cos(0.5 * light.disc));
        result.direction =
            (cosine * light.direction + std::sqrt(1 - cosine * cosine) * sideways).unit();
    } else result.position += light.radius * std::sqrt(at.area) * sideways;
    return result;
}

} // namespace

std::vector<Light> hardLights(const Light& light, int count)
{
    Light middle = light;
    middle.disc = middle.radius = 0;
    std::vector<Light> lights(std::size_t(std::max(count, 1)), middle);
    if (!light.isSoft()) return lights;
    for (int i = 0; i < count / 2; ++i)
        for (const int half : {0, 1}) {
            const int number = i + half * (count / 2);
            Light& one = lights[std::size_t(number)];
            one = moved(light, i, count, half ? -1 : 1);
            one.disc = one.radius = 0;
        }
    return lights;
}

Light shareOf(const Light& hard, const Light& soft, int count)
{
    Light result = hard;
    result.disc = soft.disc / std::sqrt(count);
    result.radius = soft.radius / std::sqrt(count);
    return result;
}

Light movedInShare(const Light& light, double u, double v)
{
    if (!light.isSoft()) return light;
    Light result = light;
    const double angle = 2 * kPi * v;
    if (light.kind == LightKind::point) {
        const double z = 2 * u - 1, flat = std::sqrt(1 - z * z);
        result.position +=
            0.7 * light.radius * Vec3d(flat * std::cos(angle), z, flat * std::sin(angle));
        return result;
    }
    const auto [b, c] = across(light.direction);
    const Vec3d sideways = std::sqrt(u) * (std::cos(angle) * b + std::sin(angle) * c);
    if (light.kind == LightKind::directional)
        result.direction = (light.direction + std::tan(0.5 * light.disc) * sideways).unit();
    else result.position += light.radius * sideways;
    return result;
}

} // namespace volcomp
