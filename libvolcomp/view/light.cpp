// SPDX-License-Identifier: Apache-2.0
#include "volcomp/view/light.h"

#include <algorithm>
#include <cmath>

#include "volcomp/base/error.h"
#include "volcomp/base/interval.h"

namespace volcomp {

void Light::validate() const
{
    const auto fail = [&](const char* expected) {
        throw Error("light '" + name + "': expected " + expected);
    };
    if (!(strength[0] >= 0 && strength[1] >= 0 && strength[2] >= 0
          && std::isfinite(strength.lengthSqr())))
        fail("a finite strength >= 0");
    if (kind != LightKind::point && !(std::abs(direction.length() - 1) < 1e-6))
        fail("a direction of unit length");
    if (kind != LightKind::directional && !std::isfinite(position.lengthSqr()))
        fail("a finite position");
    if (kind == LightKind::spot
        && !(angle > 0 && angle <= kPi && soft_angle >= 0 && std::isfinite(soft_angle)))
        fail("0 < angle <= pi and soft_angle >= 0");
    if (!(disc >= 0 && disc <= kPi)) fail("a disc of 0 to pi");
    if (!(radius >= 0 && std::isfinite(radius))) fail("a finite radius >= 0");
}

Illumination illuminate(const Light& light, const Vec3d& p, double closest)
{
    if (light.kind == LightKind::directional) return {-light.direction, kInfinity, 1};
    Vec3d L = light.position - p;
    const double distance = L.length();
    if (distance > 0) L /= distance;
    else L = light.kind == LightKind::point ? Vec3d(0, 1, 0) : Vec3d(-light.direction);
    const double d = std::max(distance, closest);
    double weight = 1 / (d * d);
    if (light.kind == LightKind::patch) weight *= std::max(0.0, -L.dot(light.direction));
    if (light.kind == LightKind::spot) {
        const double angle = std::acos(std::min(1.0, std::max(-1.0, -L.dot(light.direction))));
        const double soft = std::min(light.soft_angle, light.angle);
        const double x = soft > 0 ? std::min(1.0, std::max(0.0, (light.angle - angle) / soft))
                                  : double(angle < light.angle);
        weight *= x * x * (3 - 2 * x);
    }
    return {L, distance, weight};
}

} // namespace volcomp
