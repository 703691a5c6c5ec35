// SPDX-License-Identifier: Apache-2.0
// How a map is projected onto a surface: from points of the world to (u,v) and back (MODEL section
// 7).
#pragma once

#include "volcomp/surface/mesh.h"
#include "volcomp/base/vec.h"

namespace volcomp {

enum class ProjectionKind {
    uv,       ///< the mesh's own texture coordinates
    sphere,   ///< u is the longitude, v the latitude, 0 at the south pole, 1 at the north pole
    cylinder, ///< u is the longitude, v runs along the axis
    plane     ///< u and v are measured across the axis, in the plane perpendicular to it
};

/// A projection of a map. In the map u grows to the right and v upwards, and (0,0) is its lower
/// left corner. An eye on the +axis side of a plane sees the map upright. World units.
struct MapProjection {
    ProjectionKind kind = ProjectionKind::uv;
    Vec3d centre{0.0};
    Vec3d axis{0, 1, 0}; ///< unit
    /// Sphere and cylinder: the direction that the map's middle (u = 1/2) faces. Plane: the map's
    /// upward direction. Unit; only its part perpendicular to the axis counts.
    Vec3d up{0, 0, 1};
    double width = 1;  ///< plane: length of u from 0 to 1, > 0
    double height = 1; ///< cylinder and plane: length of v from 0 to 1, > 0

    /// Throws Error if a number is not finite, a size is not positive or `up` is parallel to the
    /// axis.
    void validate() const;

    /// Returns (u,v) of a point of the world. Longitudes lie in [0, 1); the other coordinates may
    /// lie outside of [0, 1]. On the axis of a sphere or cylinder the longitude is 1/2. Not for
    /// ProjectionKind::uv.
    Vec2d project(const Vec3d& p) const;

    /// All points that project to one (u,v).
    struct Line {
        Vec3d origin, direction; ///< the direction is unit and points to the projector, outside
        bool ray;                ///< true: only origin + t direction with t >= 0
    };
    /// The line of (u,v): on spheres and cylinders a ray from the axis outwards. Not for
    /// ProjectionKind::uv.
    Line line(const Vec2d& uv) const;

private:
    struct Frame {
        Vec3d x, y, z;
    };
    Frame frame() const;
};

} // namespace volcomp
