// SPDX-License-Identifier: Apache-2.0
// The camera and its rays.
#pragma once

#include "volcomp/base/vec.h"

namespace volcomp {

enum class Projection { perspective, orthographic };

/// Where the picture is taken from and what it shows, as the [camera] table of a scene says. World
/// space and world units. All but validate() want a camera that validate() accepts.
struct Camera {
    Projection projection = Projection::perspective;
    Vec3d eye{0, 0, 5};
    Vec3d target{0, 0, 0};
    Vec3d up{0, 1, 0}; ///< of any length; only its part across the view counts
    double field_of_view = 0.6981317007977318; ///< horizontal, radians, perspective
    double width = 2;                          ///< horizontal extent, world units, orthographic

    /// Throws Error if a value is out of range or not finite, the target is at the eye, or the view
    /// is along `up`.
    void validate() const;

    /// Returns the edge, in world units, of the square at the point `p` that one pixel of a picture
    /// `width_pixels` (> 0) wide shows. Behind the camera it is as large as at the same distance in
    /// front of it.
    double pixelFootprint(const Vec3d& p, int width_pixels) const;
};

/// The directions of a picture in the world, of unit length and perpendicular to each other.
struct CameraFrame {
    Vec3d right, up, forward;

    explicit CameraFrame(const Camera& camera);
};

/// One ray of the camera.
struct CameraRay {
    Vec3d origin, direction; ///< world units; the direction is of unit length
};

/// The rays through a picture of width x height square pixels (both > 0). It keeps a copy of what
/// it needs of the camera.
class CameraRays {
public:
    CameraRays(const Camera& camera, int width, int height);

    /// Returns the ray through (x, y), in pixels from the top left corner. The centre of the first
    /// pixel is (0.5, 0.5).
    CameraRay ray(double x, double y) const;

private:
    bool m_perspective;
    Vec3d m_eye, m_forward;
    Vec3d m_right, m_down; ///< one pixel's step in the plane at distance 1
    double m_x0, m_y0;     ///< the middle of the picture, pixels
};

} // namespace volcomp
