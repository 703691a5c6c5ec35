// SPDX-License-Identifier: Apache-2.0
#include "volcomp/place/voxel_size.h"

#include <algorithm>

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include "volcomp/base/interval.h"
#include "volcomp/place/culling.h"

namespace volcomp {

double voxelFromCamera(const std::vector<const Surface*>& surfaces, const Camera& camera, int width,
                       int height, double pixels)
{
    constexpr std::size_t kPoints = 20000;
    const auto hidden = [&](const Vec3d& p) {
        return std::any_of(surfaces.begin(), surfaces.end(),
                           [&](const Surface* s) { return s->hides(camera.eye, p); });
    };
    double smallest = kInfinity;
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
    return smallest < kInfinity ? smallest * pixels : 0;
}

double voxelFromCamera(const PlacedScene& scene, const Camera& camera, int width, int height,
                       double pixels)
{
    std::vector<const Surface*> pointers;
    for (const PlacedSurface& s : scene.surfaces) pointers.push_back(&s.surface);
    return voxelFromCamera(pointers, camera, width, height, pixels);
}

} // namespace volcomp
