// SPDX-License-Identifier: Apache-2.0
#include "volcomp/surface/map_projection.h"

#include <cmath>

#include "volcomp/base/error.h"

namespace volcomp {

void MapProjection::validate() const
{
    if (!(width > 0 && height > 0 && std::isfinite(width + height)))
        throw Error("projection: expected a width and a height that are positive");
    if (!std::isfinite(centre.lengthSqr())) throw Error("projection: expected a finite centre");
    if (!(axis.cross(up).length() > 1e-6 * axis.length() * up.length()))
        throw Error("projection: expected an up vector that is not parallel to the axis");
}

MapProjection::Frame MapProjection::frame() const
{
    const Vec3d y = axis / axis.length();
    Vec3d z = up - y * y.dot(up);
    z /= z.length();
    return {y.cross(z), y, z};
}

Vec2d MapProjection::project(const Vec3d& p) const
{
    const Frame f = frame();
    const Vec3d d = p - centre;
    const double x = d.dot(f.x), y = d.dot(f.y), z = d.dot(f.z);
    if (kind == ProjectionKind::plane) return {0.5 - x / width, 0.5 + z / height};
    double u = x == 0 && z == 0 ? 0.5 : 0.5 + std::atan2(x, z) / (2 * kPi);
    if (u >= 1) u -= 1;
    return {u,
            kind == ProjectionKind::cylinder ? 0.5 + y / height
                                             : 0.5 + std::atan2(y, std::hypot(x, z)) / kPi};
}

MapProjection::Line MapProjection::line(const Vec2d& uv) const
{
    const Frame f = frame();
    if (kind == ProjectionKind::plane)
        return {centre - f.x * ((uv[0] - 0.5) * width) + f.z * ((uv[1] - 0.5) * height), f.y,
                false};
    const double longitude = (uv[0] - 0.5) * 2 * kPi;
    const Vec3d out = f.x * std::sin(longitude) + f.z * std::cos(longitude);
    if (kind == ProjectionKind::cylinder)
        return {centre + f.y * ((uv[1] - 0.5) * height), out, true};
    const double latitude = (uv[1] - 0.5) * kPi;
    return {centre, out * std::cos(latitude) + f.y * std::sin(latitude), true};
}

} // namespace volcomp
