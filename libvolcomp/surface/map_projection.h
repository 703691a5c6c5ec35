// How a picture is thrown onto a surface: between points of the world and (u,v) (MODEL section 7).
#pragma once

#include "volcomp/surface/mesh.h"
#include "volcomp/base/vec.h"

namespace volcomp {

enum class ProjectionKind {
    uv,       ///< the mesh's own texture coordinates
    sphere,   ///< u is the longitude, v the latitude, 0 at the south pole, 1 at the north pole
    cylinder, ///< u is the longitude, v runs along the axis
    plane     ///< along the axis; the picture is upright for an eye on the +axis side
};

/// u grows to the right and v upwards in the picture: (0,0) is its lower left corner. On spheres
/// and cylinders `up` is the direction that the picture's middle (u = 1/2) faces; in the plane it
/// is the picture's upward direction.
struct MapProjection {
    ProjectionKind kind = ProjectionKind::uv;
    Vec3d centre{0.0};
    Vec3d axis{0, 1, 0}; ///< unit
    Vec3d up{0, 0, 1};   ///< unit; only its part perpendicular to the axis counts
    double width = 1;    ///< plane: world length of u from 0 to 1
    double height = 1;   ///< cylinder and plane: world length of v from 0 to 1

    /// Throws Error where a number is not finite, a size is not positive or `up` is parallel to the
    /// axis.
    void validate() const;

    /// (u,v) of a point, not for ProjectionKind::uv. Longitudes lie in [0, 1); the other
    /// coordinates may leave [0, 1]. On the axis of a sphere or cylinder the longitude is 1/2.
    Vec2d project(const Vec3d& p) const;

    /// The line of all points that project to (u,v), not for ProjectionKind::uv. On spheres and
    /// cylinders it is a ray from the axis outward.
    struct Line {
        Vec3d origin, direction; ///< direction is unit and points to where the projector stands
        bool ray;                ///< only t >= 0 counts
    };
    Line line(const Vec2d& uv) const;

private:
    struct Frame {
        Vec3d x, y, z;
    };
    Frame frame() const;
};

} // namespace volcomp
