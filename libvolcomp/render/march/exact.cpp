// SPDX-License-Identifier: Apache-2.0
// The exact way with the box filter: every voxel has one density, the ray's way through it is known
// exactly.
#include <algorithm>

#include "volcomp/render/march/integration.h"
#include "volcomp/render/march/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "volcomp/render/march/exact.cpp"
#include <hwy/foreach_target.h> // NOLINT(misc-header-include-cycle)
#include <hwy/highway.h>

#include "volcomp/render/march/fast_walk-inl.h"

HWY_BEFORE_NAMESPACE();
namespace volcomp::HWY_NAMESPACE {
namespace {

template <bool kDirected>
void traceVoxels(const MarchScene& scene, const MarchRay& r, const Vec3d& direction,
                 RaySample& sample, RayScratch& scratch)
{
    const VoxelTree& tree = scene.tree;
    forEachLeaf(tree, r, [&](const LeafSpan& span) {
        const LeafDensities density = tree.densities(span.leaf);
        const bool directed = kDirected && tree.leaf(span.leaf).directed;
        const LeafWay way(r, *span.start, FastWalk());
        for (int i = 0; i < way.count; ++i) {
            const int voxel = way.voxels[i];
            const float rho = density[voxel];
            if (!(rho > 0)) continue;
            const double t = way.times[i], end = std::min(way.times[i + 1], r.t1);
            if (!(end > t)) continue;
            double delta = scene.extinction * rho * (end - t);
            if (directed) delta *= tree.directionFactor(span.leaf, voxel, direction);
            if (delta == 0) continue;
            const SeenVoxel seen{span.leaf,
                                 voxel,
                                 {span.cell[0] + (voxel >> 6), span.cell[1] + (voxel >> 3 & 7),
                                  span.cell[2] + (voxel & 7)}};
            scratch.shading.start(scene.lights.size());
            shadeVoxel(scene, seen, r.at(0.5 * (t + end)), -direction, scratch.shading);
            addSegment(
                scene,
                {delta, t, end, r.at(t), r.at(end), {seen.cell[0], seen.cell[1], seen.cell[2]}},
                sample, scratch);
            if (sample.transmittance < scene.params.cutoff) return false;
        }
        return true;
    });
}

HWY_FLATTEN double depth(const MarchScene& scene, const MarchRay& r, const Vec3d& direction)
{
    return scene.extinction
        * (scene.directed ? lineIntegral<true, FastWalk>(scene.tree, r, direction, scene.stop)
                          : lineIntegral<false, FastWalk>(scene.tree, r, direction, scene.stop));
}

HWY_FLATTEN double shortDepth(const MarchScene& scene, const MarchRay& r, const int* cell,
                              const Vec3d& direction)
{
    return scene.extinction
        * (scene.directed ? shortIntegral<true, FastWalk>(scene.tree, r, cell, direction)
                          : shortIntegral<false, FastWalk>(scene.tree, r, cell, direction));
}

HWY_FLATTEN void trace(const MarchScene& scene, const MarchRay& r, const Vec3d& direction,
                       RaySample& sample, RayScratch& scratch)
{
    if (scene.directed) traceVoxels<true>(scene, r, direction, sample, scratch);
    else traceVoxels<false>(scene, r, direction, sample, scratch);
}

} // namespace
} // namespace volcomp::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace volcomp {
namespace {

HWY_EXPORT(depth);
HWY_EXPORT(shortDepth);
HWY_EXPORT(trace);

} // namespace

double exactDepth(const MarchScene& scene, const MarchRay& r, const Vec3d& direction)
{
    return HWY_DYNAMIC_DISPATCH(depth)(scene, r, direction);
}

double exactShortDepth(const MarchScene& scene, const MarchRay& r, const int* cell,
                       const Vec3d& direction)
{
    return HWY_DYNAMIC_DISPATCH(shortDepth)(scene, r, cell, direction);
}

void traceExact(const MarchScene& scene, const MarchRay& r, const Vec3d& direction,
                RaySample& sample, RayScratch& scratch)
{
    HWY_DYNAMIC_DISPATCH(trace)(scene, r, direction, sample, scratch);
}

} // namespace volcomp
#endif
