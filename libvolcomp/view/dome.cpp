// SPDX-License-Identifier: Apache-2.0
#include "volcomp/view/dome.h"

#include <algorithm>
#include <cmath>

#include "volcomp/base/error.h"

namespace volcomp {

bool Dome::black() const
{
    const auto dark = [](const Vec3d& v) { return v == Vec3d(0.0); };
    if (strength == 0) return true;
    switch (kind) {
    case DomeKind::constant:
        return dark(colour);
    case DomeKind::gradient:
        return dark(zenith) && dark(horizon) && dark(ground);
    case DomeKind::image:
        return false;
    }
    return true;
}

Vec3d Dome::radiance(const Vec3d& d) const
{
    switch (kind) {
    case DomeKind::constant:
        return strength * colour;
    case DomeKind::gradient: {
        if (d[1] < 0) return strength * ground;
        const double up = std::asin(std::min(1.0, d[1])) / (0.5 * kPi);
        return strength * ((1 - up) * horizon + up * zenith);
    }
    case DomeKind::image:
        return Vec3d(0.0);
    }
    return Vec3d(0.0);
}

void Dome::validate() const
{
    for (const Vec3d& c : {colour, zenith, horizon, ground})
        if (!(c[0] >= 0 && c[1] >= 0 && c[2] >= 0 && std::isfinite(c.lengthSqr())))
            throw Error("dome: expected finite radiances >= 0");
    if (!(strength >= 0 && std::isfinite(strength) && std::isfinite(rotate)))
        throw Error("dome: expected a finite strength >= 0 and a finite angle");
}

} // namespace volcomp
