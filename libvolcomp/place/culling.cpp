// SPDX-License-Identifier: Apache-2.0
#include "volcomp/place/culling.h"

#include <algorithm>
#include <cmath>

#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include "volcomp/base/interval.h"

namespace volcomp {
namespace {

using Ball = BoxBall;

Ball placed(const Ball& ball, const Placement& p)
{
    if (ball.radius < 0) return ball;
    const Vec3d c = Vec3d(p.x_axis) * ball.centre[0] + Vec3d(p.y_axis) * ball.centre[1]
        + Vec3d(p.z_axis) * ball.centre[2];
    return {p.position + c * double(p.scale), ball.radius * p.scale};
}

/// Returns true if the ray from `p` meets the bounds widened by `margin`.
bool meets(const openvdb::BBoxd& bounds, const Vec3d& p, const Vec3d& direction, double margin)
{
    double from = 0, to = kInfinity;
    for (int i = 0; i < 3; ++i) {
        const double low = bounds.min()[i] - margin - p[i], high = bounds.max()[i] + margin - p[i];
        if (direction[i] == 0) {
            if (low > 0 || high < 0) return false;
            continue;
        }
        const double a = low / direction[i], b = high / direction[i];
        from = std::max(from, std::min(a, b));
        to = std::min(to, std::max(a, b));
    }
    return from <= to;
}

/// Returns true if the shadow that a light makes of the ball may reach `seen`.
bool mayShade(const Light& light, const Ball& b, const openvdb::BBoxd& seen)
{
    if (light.kind == LightKind::directional)
        return meets(seen, b.centre, light.direction, b.radius);
    // A shadow from a near light widens with the distance.
    const Vec3d away = b.centre - light.position;
    const double near_by = away.length() - b.radius,
                 far_off = (seen.getCenter() - light.position).length() + seen.extents().length();
    return near_by <= 0 || meets(seen, b.centre, away, b.radius * std::max(1.0, far_off / near_by));
}

} // namespace

BoxBall ballOf(const Box& box)
{
    openvdb::BBoxd bounds;
    for (const VolumePart& part : box.volume.parts) {
        const openvdb::CoordBBox b = part.density->evalActiveVoxelBoundingBox();
        if (b.empty()) continue;
        const double h = part.density->voxelSize()[0];
        bounds.expand(openvdb::BBoxd((b.min().asVec3d() - Vec3d(0.5)) * h,
                                     (b.max().asVec3d() + Vec3d(0.5)) * h));
    }
    if (bounds.empty()) return {};
    return {bounds.getCenter(), bounds.extents().length() / 2};
}

bool mayBeInView(const Camera& camera, int width, int height, const Vec3d& centre, double radius)
{
    const CameraFrame frame(camera);
    const Vec3d d = centre - camera.eye;
    const double z = d.dot(frame.forward),
                 across[2] = {std::abs(d.dot(frame.right)), std::abs(d.dot(frame.up))};
    if (z < -radius) return false;
    for (int i = 0; i < 2; ++i) {
        const double aspect = i == 0 ? 1.0 : double(height) / width;
        if (camera.projection == Projection::orthographic) {
            if (across[i] > camera.width / 2 * aspect + radius) return false;
        } else {
            const double t = std::tan(camera.field_of_view / 2) * aspect;
            if (across[i] - z * t > radius * std::sqrt(1 + t * t)) return false;
        }
    }
    return true;
}

ViewedRange viewedRange(const PlacementList& list, const std::vector<BoxBall>& balls,
                        const Camera& camera, int width_pixels, int height_pixels)
{
    const auto wider = [](ViewedRange a, const ViewedRange& b) {
        return ViewedRange{std::min(a.nearest, b.nearest), std::max(a.farthest, b.farthest)};
    };
    const ViewedRange none{kInfinity, 0};
    const ViewedRange range = tbb::parallel_reduce(
        tbb::blocked_range<std::size_t>(0, list.size(), 4096), none,
        [&](const auto& part, ViewedRange so_far) {
            for (std::size_t i = part.begin(); i < part.end(); ++i) {
                const Placement& p = list.placements[i];
                const Ball ball = placed(balls[p.box], p);
                if (ball.radius < 0
                    || !mayBeInView(camera, width_pixels, height_pixels, ball.centre, ball.radius))
                    continue;
                const double distance = (ball.centre - camera.eye).length();
                so_far =
                    wider(so_far, {std::max(0.0, distance - ball.radius), distance + ball.radius});
            }
            return so_far;
        },
        wider);
    return range.farthest > 0 ? range : ViewedRange();
}

std::size_t cullPlacements(PlacementList& list, const std::vector<Box>& boxes, const Camera& camera,
                           int width, int height, const std::vector<Light>& lights)
{
    std::vector<Ball> balls;
    balls.reserve(boxes.size());
    for (const Box& box : boxes) balls.push_back(ballOf(box));
    const std::size_t count = list.size();
    const auto ball = [&](std::size_t i) {
        return placed(balls[list.placements[i].box], list.placements[i]);
    };
    std::vector<char> keep(count, 0);
    tbb::parallel_for(std::size_t(0), count, [&](std::size_t i) {
        const Ball b = ball(i);
        keep[i] = b.radius >= 0 && mayBeInView(camera, width, height, b.centre, b.radius);
    });
    openvdb::BBoxd seen;
    for (std::size_t i = 0; i < count; ++i)
        if (keep[i]) {
            const Ball b = ball(i);
            seen.expand(openvdb::BBoxd(b.centre - Vec3d(b.radius), b.centre + Vec3d(b.radius)));
        }
    if (!seen.empty())
        tbb::parallel_for(std::size_t(0), count, [&](std::size_t i) {
            const Ball b = ball(i);
            if (keep[i] || b.radius < 0) return;
            keep[i] = std::any_of(lights.begin(), lights.end(),
                                  [&](const Light& light) { return mayShade(light, b, seen); });
        });
    list.filter(keep);
    return count - list.size();
}

} // namespace volcomp
