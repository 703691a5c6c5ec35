// SPDX-License-Identifier: Apache-2.0
// Boxes and placements that several tests compose.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "volcomp/compose/compose.h"
#include "volcomp/base/random.h"
#include "tests/support/volumes.h"

namespace volcomp {

inline const bool kOpenvdbStarted = (openvdb::initialize(), true); // before any test

/// A part without voxels, of all three grids.
inline VolumePart fullPart(double voxel, const std::string& material = "fur")
{
    VolumePart part = emptyPart(voxel);
    part.material = material;
    const auto transform = part.density->transformPtr();
    part.direction = openvdb::Vec3SGrid::create(openvdb::Vec3s(0.0f));
    part.direction->setTransform(transform);
    part.colour = openvdb::Vec3SGrid::create(openvdb::Vec3s(0.0f));
    part.colour->setTransform(transform);
    return part;
}

inline void set(VolumePart& part, const openvdb::Coord& c, float density, const Vec3f& direction,
                const Vec3f& colour)
{
    part.density->tree().setValue(c, density);
    part.direction->tree().setValue(c, direction);
    part.colour->tree().setValue(c, colour);
}

/// Random curved strands, one voxel thick.
inline Box strands(int nx, int ny, int count, double voxel, std::uint64_t seed)
{
    Box box{"tuft", 0, {}};
    VolumePart part = fullPart(voxel);
    for (int s = 0; s < count; ++s) {
        Random random(hashKey(seed, static_cast<std::uint64_t>(s)));
        double x = random.uniform(-0.25, 0.25) * nx, z = random.uniform(-0.25, 0.25) * nx,
               dx = random.symmetric() * 0.2, dz = random.symmetric() * 0.2;
        const double bend_x = random.symmetric() * 0.006, bend_z = random.symmetric() * 0.006;
        const auto rho = static_cast<float>(random.uniform(20, 60));
        const Vec3f colour(float(random.uniform()), float(random.uniform()),
                           float(random.uniform()));
        for (int y = 0; y < ny; ++y) {
            Vec3f t(float(dx), 1, float(dz));
            t.normalize();
            set(part, openvdb::Coord(int(std::lround(x)), y, int(std::lround(z))), rho, t, colour);
            x += dx, z += dz, dx += bend_x, dz += bend_z;
        }
    }
    box.volume.parts.push_back(part);
    return box;
}

/// A box turned by an angle about an axis through its root.
inline Placement turned(const Vec3d& axis, double angle, const Vec3d& position, float scale = 1)
{
    const auto rotation = openvdb::math::rotation<openvdb::math::Mat3<double>>(axis.unit(), angle);
    const auto column = [&](const Vec3d& e) { return Vec3f(rotation * e); };
    Placement p;
    p.x_axis = column({1, 0, 0});
    p.y_axis = column({0, 1, 0});
    p.z_axis = column({0, 0, 1});
    p.position = position;
    p.scale = scale;
    return p;
}

/// Any turn, a place up to `reach` from the origin along each axis, a size between `low` and
/// `high`, any tint.
inline Placement randomPlacement(std::uint64_t key, double reach, double low = 0.8,
                                 double high = 1.2)
{
    Random r(key);
    Vec3d axis(r.normal(), r.normal(), r.normal());
    Placement p = turned(axis, r.uniform(0, 2 * kPi),
                         {r.symmetric() * reach, r.symmetric() * reach, r.symmetric() * reach},
                         float(r.uniform(low, high)));
    p.tint = Vec3f(float(r.uniform()), float(r.uniform()), float(r.uniform()));
    return p;
}

inline Volume composed(const std::vector<Box>& boxes, const std::vector<Placement>& placements,
                       const ComposeParams& params)
{
    return unpack(compose(boxes, placements, params));
}

inline ComposeParams voxel(double size)
{
    ComposeParams p;
    p.keep = Kept::integral; // what most tests sum up
    p.voxel = size;
    p.minimum_depth = 0; // so that sums are exact
    return p;
}

} // namespace volcomp
