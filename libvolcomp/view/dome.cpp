// SPDX-License-Identifier: Apache-2.0
#include "volcomp/view/dome.h"

#include <algorithm>
#include <cmath>

#include "volcomp/base/error.h"
#include "volcomp/view/dome_image.h"
#include "volcomp/view/dome_suns.h"

namespace volcomp {

/// What loadDome() made of a file.
struct LoadedDome {
    DomeImage fine, coarse;
};

namespace {

/// Around +y, from -z towards +x.
Vec3d turned(const Vec3d& d, double angle)
{
    const double c = std::cos(angle), s = std::sin(angle);
    return {c * d[0] - s * d[2], d[1], c * d[2] + s * d[0]};
}

} // namespace

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
        return image && image->fine.black;
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
        return image ? strength * image->fine.at(turned(d, -rotate), false) : Vec3d(0.0);
    }
    return Vec3d(0.0);
}

Vec3d Dome::softRadiance(const Vec3d& d) const
{
    return kind == DomeKind::image && image ? strength * image->coarse.at(turned(d, -rotate), false)
                                            : radiance(d);
}

Vec3d Dome::seen(const Vec3d& d) const
{
    return kind == DomeKind::image && image ? strength * image->fine.at(turned(d, -rotate), true)
                                            : radiance(d);
}

void Dome::validate() const
{
    for (const Vec3d& c : {colour, zenith, horizon, ground})
        if (!(c[0] >= 0 && c[1] >= 0 && c[2] >= 0 && std::isfinite(c.lengthSqr())))
            throw Error("dome: expected finite radiances >= 0");
    if (!(strength >= 0 && std::isfinite(strength) && std::isfinite(rotate)))
        throw Error("dome: expected a finite strength >= 0 and a finite angle");
}

std::vector<Light> loadDome(Dome& dome)
{
    std::vector<Light> lights;
    if (dome.kind != DomeKind::image) return lights;
    auto image = std::make_shared<LoadedDome>();
    image->fine = readDomeImage(dome.file);
    for (const DomeSun& sun : takeSuns(image->fine)) {
        Light& light = lights.emplace_back();
        light.direction = -turned(sun.direction, dome.rotate);
        light.strength = dome.strength / kPi * sun.irradiance;
        light.disc = sun.disc;
    }
    image->coarse = coarseDome(image->fine);
    dome.image = std::move(image);
    return lights;
}

} // namespace volcomp
