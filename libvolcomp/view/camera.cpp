// SPDX-License-Identifier: Apache-2.0
#include "volcomp/view/camera.h"

#include <cmath>

#include "volcomp/base/error.h"

namespace volcomp {

void Camera::validate() const
{
    const Vec3d view = target - eye;
    if (!std::isfinite(eye.lengthSqr() + target.lengthSqr() + up.lengthSqr()))
        throw Error("camera: expected finite eye, target and up");
    if (!(view.cross(up).length() > 1e-9 * view.length() * up.length()))
        throw Error("camera: expected a target away from the eye, not straight along `up`");
    if (projection == Projection::perspective && !(field_of_view > 0 && field_of_view < kPi))
        throw Error("camera: expected 0 < field_of_view < pi radians");
    if (projection == Projection::orthographic && !(width > 0 && std::isfinite(width)))
        throw Error("camera: expected a finite width > 0");
}

CameraFrame::CameraFrame(const Camera& camera) : forward(camera.target - camera.eye)
{
    forward.normalize();
    right = forward.cross(camera.up);
    right.normalize();
    up = right.cross(forward);
}

CameraRays::CameraRays(const Camera& camera, int width, int height)
    : m_perspective(camera.projection == Projection::perspective), m_eye(camera.eye),
      m_x0(0.5 * width), m_y0(0.5 * height)
{
    const CameraFrame frame(camera);
    m_forward = frame.forward;
    m_right = frame.right;
    m_down = -frame.up;
    const double pixel =
        (m_perspective ? 2 * std::tan(camera.field_of_view / 2) : camera.width) / width;
    m_right *= pixel;
    m_down *= pixel;
}

CameraRay CameraRays::ray(double x, double y) const
{
    const Vec3d offset = m_right * (x - m_x0) + m_down * (y - m_y0);
    if (!m_perspective) return {m_eye + offset, m_forward};
    Vec3d direction = m_forward + offset;
    direction.normalize();
    return {m_eye, direction};
}

double Camera::pixelFootprint(const Vec3d& p, int width_pixels) const
{
    if (projection == Projection::orthographic) return width / width_pixels;
    const double distance = std::abs(CameraFrame(*this).forward.dot(p - eye));
    return 2 * std::tan(field_of_view / 2) * distance / width_pixels;
}

} // namespace volcomp
