#include "volcomp/place/culling.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

namespace volcomp {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

struct Ball {
    Vec3d centre{0.0};
    double radius = -1; ///< -1: empty
};

/// Around all voxels of a box, in its own space.
Ball ballOf(const Box& box)
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

Ball placed(const Ball& ball, const Placement& p)
{
    if (ball.radius < 0) return ball;
    const Vec3d c = Vec3d(p.x_axis) * ball.centre[0] + Vec3d(p.y_axis) * ball.centre[1]
        + Vec3d(p.z_axis) * ball.centre[2];
    return {p.position + c * double(p.scale), ball.radius * p.scale};
}

/// True where the ray from `p` meets the bounds widened by `margin`.
bool meets(const openvdb::BBoxd& bounds, const Vec3d& p, const Vec3d& direction, double margin)
{
    double from = 0, to = kNever;
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

} // namespace

bool mayBeInView(const Camera& camera, int width, int height, const Vec3d& centre, double radius)
{
    const Vec3d forward = (camera.target - camera.eye).unit(),
                right = forward.cross(camera.up).unit(), up = right.cross(forward);
    const Vec3d d = centre - camera.eye;
    const double z = d.dot(forward), across[2] = {std::abs(d.dot(right)), std::abs(d.dot(up))};
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

double voxelFromCamera(const std::vector<const Surface*>& surfaces, const Camera& camera, int width,
                       int height, double pixels)
{
    constexpr std::size_t kPoints = 20000;
    const auto hidden = [&](const Vec3d& p) {
        return std::any_of(surfaces.begin(), surfaces.end(),
                           [&](const Surface* s) { return s->hides(camera.eye, p); });
    };
    double smallest = kNever;
    for (const Surface* s : surfaces) {
        const auto& points = s->mesh().points;
        const std::size_t step = points.size() / kPoints + 1, corners = points.size() / step,
                          count = kPoints + corners;
        smallest = tbb::parallel_reduce(
            tbb::blocked_range<std::size_t>(0, count, 256), smallest,
            [&](const tbb::blocked_range<std::size_t>& range, double least) {
                for (std::size_t i = range.begin(); i < range.end(); ++i) {
                    const Vec3d p = i < kPoints
                        ? s->atFraction((double(i) + 0.5) / kPoints).position
                        : points[(i - kPoints) * step];
                    if (!mayBeInView(camera, width, height, p, 0)) continue;
                    const double footprint = camera.pixelFootprint(p, width);
                    if (footprint > 0 && footprint < least && !hidden(p)) least = footprint;
                }
                return least;
            },
            [](double a, double b) { return std::min(a, b); });
    }
    return smallest < kNever ? smallest * pixels : 0;
}

std::vector<Placement> cullPlacements(const std::vector<Placement>& placements,
                                      const std::vector<Box>& boxes, const Camera& camera,
                                      int width, int height, const std::vector<Light>& lights)
{
    std::vector<Ball> balls;
    balls.reserve(boxes.size());
    for (const Box& box : boxes) balls.push_back(ballOf(box));
    std::vector<char> keep(placements.size(), 0);
    tbb::parallel_for(std::size_t(0), placements.size(), [&](std::size_t i) {
        const Ball b = placed(balls[placements[i].box], placements[i]);
        keep[i] = b.radius >= 0 && mayBeInView(camera, width, height, b.centre, b.radius);
    });
    openvdb::BBoxd seen;
    for (std::size_t i = 0; i < placements.size(); ++i)
        if (keep[i]) {
            const Ball b = placed(balls[placements[i].box], placements[i]);
            seen.expand(openvdb::BBoxd(b.centre - Vec3d(b.radius), b.centre + Vec3d(b.radius)));
        }
    if (seen.empty()) return {};
    const double reach = seen.extents().length();
    tbb::parallel_for(std::size_t(0), placements.size(), [&](std::size_t i) {
        const Ball b = placed(balls[placements[i].box], placements[i]);
        if (keep[i] || b.radius < 0) return;
        for (const Light& light : lights) {
            if (light.kind == LightKind::directional) {
                if (meets(seen, b.centre, light.direction, b.radius)) keep[i] = 1;
                continue;
            }
            // A shadow from a near light widens with the distance.
            const Vec3d away = b.centre - light.position;
            const double near_by = away.length() - b.radius,
                         far_off = (seen.getCenter() - light.position).length() + reach;
            if (near_by <= 0
                || meets(seen, b.centre, away, b.radius * std::max(1.0, far_off / near_by)))
                keep[i] = 1;
        }
    });
    std::vector<Placement> result;
    for (std::size_t i = 0; i < placements.size(); ++i)
        if (keep[i]) result.push_back(placements[i]);
    return result;
}

} // namespace volcomp
