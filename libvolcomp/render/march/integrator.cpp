// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/march/integrator.h"

#include <algorithm>
#include <cmath>

#include "volcomp/base/interval.h"
#include "volcomp/render/march/integration.h"

namespace volcomp {

RaySample Integrator::trace(const Vec3d& origin, const Vec3d& direction, Scratch& scratch) const
{
    RaySample sample;
    ++scratch.counts.rays;
    if (m_scene.params.aovs) scratch.light_radiance.assign(m_scene.lights.size(), Vec3d(0.0));
    scratch.haze = HazeRay(m_scene.params.haze, origin, direction);
    traceFurther(sample, origin, direction, 0, kInfinity, scratch);
    return sample;
}

void Integrator::traceFurther(RaySample& sample, const Vec3d& origin, const Vec3d& direction,
                              double start, double end, Scratch& scratch) const
{
    if (!(std::abs(direction.length() - 1) < 1e-3)) return;
    const VoxelTree& tree = m_scene.tree;
    const Vec3d o = tree.toCorner(origin), d = tree.directionToCorner(direction);
    start /= tree.voxelSize();
    end /= tree.voxelSize();
    scratch.startRay(m_scene.lights.size());
    const MarchRay r = m_scene.dual ? MarchRay(*m_scene.dual, o - Vec3d(0.5), d, end, start)
                                    : MarchRay(tree, o, d, end, start);
    if (m_scene.transmits_only && !scratch.observer)
        sample.transmittance *= std::exp(-depthAlong(m_scene, r, direction));
    else if (m_scene.params.integration == Integration::riemann)
        traceSums(m_scene, r, direction, sample, scratch);
    else if (m_scene.dual) traceTrilinear(m_scene, r, direction, sample, scratch);
    else traceExact(m_scene, r, direction, sample, scratch);
}

double depthAlong(const MarchScene& scene, const MarchRay& r, const Vec3d& direction)
{
    if (scene.params.integration == Integration::riemann) return sumDepth(scene, r, direction);
    return scene.dual ? trilinearDepth(scene, r, direction) : exactDepth(scene, r, direction);
}

double Integrator::markLeaves(const Vec3d& origin, const Vec3d& direction, double from, double to,
                              double depth, std::vector<float>& seen) const
{
    const VoxelTree& tree = m_scene.tree;
    const MarchRay r(tree, tree.toCorner(origin), tree.directionToCorner(direction),
                     to / tree.voxelSize(), from / tree.voxelSize());
    forEachLeaf(tree, r, [&](const LeafSpan& span) {
        const LeafDensities density = tree.densities(span.leaf);
        double greatest = 0;
        forEachVoxel(r, *span.start, [&](int voxel, double t, double end) {
            if (!(density[voxel] > 0)) return;
            double delta = m_scene.extinction * double(density[voxel]) * (end - t);
            if (m_scene.directed) delta *= tree.directionFactor(span.leaf, voxel, direction);
            greatest = std::max(greatest, std::exp(-depth) * -std::expm1(-delta));
            depth += delta;
        });
        const std::size_t place = tree.place(span.node, span.leaf, span.cell);
        if (place >= seen.size()) seen.resize(tree.placeCount(), 0);
        seen[place] = std::max(seen[place], float(greatest));
        return depth < darkest();
    });
    return depth;
}

} // namespace volcomp
