// SPDX-License-Identifier: Apache-2.0
#include "volcomp/scene/groom_voxel.h"

#include <algorithm>
#include <vector>

#include "volcomp/base/interval.h"
#include "volcomp/place/culling.h"

namespace volcomp {

double groomVoxel(const Scene& scene, const CurvePieces& groom)
{
    if (scene.compose.voxel > 0) return scene.compose.voxel;
    double least = kInfinity;
    std::vector<double> radii;
    radii.reserve(groom.segmentCount() + groom.strandCount());
    groom.forPoints([&](const Vec3d& p, double radius) {
        radii.push_back(radius);
        if (!mayBeInView(scene.camera, scene.render.width, scene.render.height, p, radius)) return;
        const double footprint = scene.camera.pixelFootprint(p, scene.render.width);
        if (footprint > 0) least = std::min(least, footprint);
    });
    if (!(least < kInfinity)) return 0;
    const auto median = radii.begin() + std::ptrdiff_t(radii.size() / 2);
    std::nth_element(radii.begin(), median, radii.end());
    return std::max(scene.compose.voxel_pixels * least, 2 * *median);
}

} // namespace volcomp
