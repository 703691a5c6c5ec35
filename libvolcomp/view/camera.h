// Where the picture is taken from.
#pragma once

#include "volcomp/base/vec.h"

namespace volcomp {

enum class Projection { perspective, orthographic };

/// Where the picture is taken from, as the [camera] table says.
struct Camera {
    Projection projection = Projection::perspective;
    Vec3d eye{0, 0, 5};
    Vec3d target{0, 0, 0};
    Vec3d up{0, 1, 0};
    double field_of_view = 0.6981317007977318; ///< horizontal, radians, perspective
    double width = 2;                          ///< horizontal extent, world units, orthographic

    /// Throws Error where a value is out of range or not finite, or the view has no direction or no
    /// up.
    void validate() const;

    /// Edge of the square that one pixel of a picture `width_pixels` wide covers at the point `p`,
    /// world units.
    double pixelFootprint(const Vec3d& p, int width_pixels) const;
};

/// One ray of the camera, world units.
struct CameraRay {
    Vec3d origin, direction; ///< world; the direction is unit length
};

/// The rays of a picture of width x height square pixels.
class CameraRays {
public:
    CameraRays(const Camera& camera, int width, int height);

    /// Through (x, y) in pixels from the top left corner; the first pixel's centre is (0.5, 0.5).
    CameraRay ray(double x, double y) const;

private:
    bool m_perspective;
    Vec3d m_eye, m_forward, m_right,
        m_down; ///< of a ray at the picture's middle; steps of one pixel
    double m_x0, m_y0;
};

} // namespace volcomp
