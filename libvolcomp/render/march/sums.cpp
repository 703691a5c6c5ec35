// SPDX-License-Identifier: Apache-2.0
// The paper's sums (3) and (4), with either filter: samples at the middles of equal steps.
#include <cmath>

#include "volcomp/render/march/dual_march.h"
#include "volcomp/render/march/integration.h"

namespace volcomp {
namespace {

void voxelOf(const Vec3d& p, int* voxel)
{
    for (int a = 0; a < 3; ++a) voxel[a] = int(std::floor(p[a]));
}

// Calls f(weight, voxel) for the voxels that the filter sees at a point, in the tree's coordinates.
template <class F>
void filterAt(const VoxelTree&, const Vec3d& p, F&& f)
{
    int v[3];
    voxelOf(p, v);
    f(1.0, v);
}
template <class F>
void filterAt(const DualTree&, const Vec3d& p, F&& f)
{
    int cell[3];
    voxelOf(p, cell);
    const double x = p[0] - cell[0], y = p[1] - cell[1], z = p[2] - cell[2];
    for (int k = 0; k < 8; ++k) {
        int v[3];
        cornerVoxel(cell, k, v);
        f((k >> 2 ? x : 1 - x) * (k >> 1 & 1 ? y : 1 - y) * (k & 1 ? z : 1 - z), v);
    }
}

// Calls f(t) at the middles of steps inside the leaves of the ray, until it returns false.
template <class Tree, class F>
void forEachStep(const Tree& tree, const MarchRay& r, double step, F&& f)
{
    forEachLeaf(tree, r, [&](const LeafSpan& span) {
        for (double k = std::ceil(span.t / step - 0.5);; ++k) {
            const double t = (k + 0.5) * step;
            if (t >= span.t_end) return true;
            if (!f(t)) return false;
        }
    });
}

// A voxel's density as a ray of this direction sees it; 0 outside of the volume.
double effectiveDensity(const MarchScene& scene, const int* v, const Vec3d& direction)
{
    const VoxelTree& tree = scene.tree;
    const int leaf = tree.leafAt(v[0], v[1], v[2]);
    if (leaf == VoxelTree::kEmpty) return 0;
    const int voxel = VoxelTree::offset(v[0], v[1], v[2]);
    const double rho = tree.densities(leaf)[voxel];
    return scene.directed && rho > 0 ? rho * tree.directionFactor(leaf, voxel, direction) : rho;
}

// Sum (3).
template <class Tree>
double sumAlong(const MarchScene& scene, const Tree& tree, const MarchRay& r, const Vec3d& d)
{
    double sum = 0;
    forEachStep(tree, r, scene.params.step, [&](double t) {
        filterAt(tree, r.at(t), [&](double weight, const int* v) {
            sum += weight * scene.params.step * effectiveDensity(scene, v, d);
        });
        return sum < scene.stop;
    });
    return scene.extinction * sum;
}

// Sum (4). `shift` leads from the tree's coordinates to corner coordinates.
template <class Tree>
void traceSteps(const MarchScene& scene, const Tree& tree, const MarchRay& r, double shift,
                const Vec3d& direction, RaySample& sample, RayScratch& scratch)
{
    const double step = scene.params.step;
    forEachStep(tree, r, step, [&](double t) {
        const Vec3d at = r.at(t), p = at + Vec3d(shift);
        RaySegment segment{0, t, t, p, p, {}};
        filterAt(tree, at, [&](double weight, const int* v) {
            segment.delta +=
                weight * step * scene.extinction * effectiveDensity(scene, v, direction);
        });
        if (!(segment.delta > 0)) return true;
        scratch.shading.start(scene.lights.size());
        filterAt(tree, at, [&](double weight, const int* v) {
            const double share = weight * step * scene.extinction
                * effectiveDensity(scene, v, direction) / segment.delta;
            if (share > 0)
                shadeVoxel(scene,
                           {scene.tree.leafAt(v[0], v[1], v[2]),
                            VoxelTree::offset(v[0], v[1], v[2]),
                            {v[0], v[1], v[2]},
                            share},
                           p, -direction, scratch.shading);
        });
        voxelOf(p, segment.cell);
        addSegment(scene, segment, sample, scratch);
        return sample.transmittance >= scene.params.cutoff;
    });
}

} // namespace

double sumDepth(const MarchScene& scene, const MarchRay& r, const Vec3d& direction)
{
    return scene.dual ? sumAlong(scene, *scene.dual, r, direction)
                      : sumAlong(scene, scene.tree, r, direction);
}

void traceSums(const MarchScene& scene, const MarchRay& r, const Vec3d& direction,
               RaySample& sample, RayScratch& scratch)
{
    if (scene.dual) traceSteps(scene, *scene.dual, r, 0.5, direction, sample, scratch);
    else traceSteps(scene, scene.tree, r, 0, direction, sample, scratch);
}

} // namespace volcomp
