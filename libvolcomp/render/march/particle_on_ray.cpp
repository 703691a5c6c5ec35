// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/march/particle_on_ray.h"

#include <algorithm>

#include "volcomp/render/march/march.h"

namespace volcomp {

std::optional<ParticleOnRay> particleAtDepth(const MarchScene& scene, const MarchRay& ray,
                                             const Vec3d& direction, double depth)
{
    const VoxelTree& tree = scene.tree;
    std::optional<ParticleOnRay> found;
    double left = depth;
    forEachLeaf(tree, ray, [&](const LeafSpan& span) {
        const LeafDensities density = tree.densities(span.leaf);
        const bool directed = scene.directed && tree.leaf(span.leaf).directed;
        const LeafWay way(ray, *span.start, PlainWalk());
        for (int i = 0; i < way.count; ++i) {
            const int voxel = way.voxels[i];
            const double t = way.times[i], end = std::min(way.times[i + 1], ray.t1);
            if (!(density[voxel] > 0) || !(end > t)) continue;
            double per_voxel = scene.extinction * double(density[voxel]);
            if (directed) per_voxel *= tree.directionFactor(span.leaf, voxel, direction);
            const double here = per_voxel * (end - t);
            if (here > left) {
                const SeenVoxel seen{span.leaf,
                                     voxel,
                                     {span.cell[0] + (voxel >> 6), span.cell[1] + (voxel >> 3 & 7),
                                      span.cell[2] + (voxel & 7)}};
                found = ParticleOnRay{seen, ray.at(t + left / per_voxel)};
                return false;
            }
            left -= here;
        }
        return true;
    });
    return found;
}

} // namespace volcomp
