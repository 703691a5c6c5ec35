// SPDX-License-Identifier: Apache-2.0
// How fast rays go through fur: voxels per second of both filters beside OpenVDB's own tools,
// shadows by rays and by the sweep, building of the tree and of its levels. The fur is made here:
// hairs of one voxel on a ball.
#include <cmath>

#include <benchmark/benchmark.h>
#include <openvdb/math/DDA.h>
#include <openvdb/tools/Interpolation.h>
#include <openvdb/tools/RayIntersector.h>

#include "volcomp/render/march/integration.h"
#include "volcomp/base/parallel.h"
#include "volcomp/base/random.h"
#include "volcomp/render/render.h"
#include "volcomp/render/tree/voxel_tree.h"

using namespace volcomp;

namespace {

constexpr double kRadius = 100;   ///< of the skin, voxels; hairs are as long as a quarter of it
constexpr double kExtinction = 1; ///< optical depth of density 1 over one voxel

const Volume& fur()
{
    static const Volume volume = [] {
        Volume v;
        v.parts.emplace_back();
        v.parts[0].density = openvdb::FloatGrid::create(0.0f);
        auto accessor = v.parts[0].density->getAccessor();
        Random random(1);
        for (int hair = 0; hair < 25000; ++hair) {
            const Vec3d n = Vec3d(random.normal(), random.normal(), random.normal()).unit();
            const Vec3d bend =
                0.4 * Vec3d(random.symmetric(), random.symmetric(), random.symmetric());
            for (double s = 0; s < 0.25 * kRadius; s += 0.5)
                accessor.setValue(
                    openvdb::Coord::round(n * (kRadius + s) + bend * (s * s / (0.25 * kRadius))),
                    1.0f);
        }
        return v;
    }();
    return volume;
}

const VoxelTree& tree()
{
    static const VoxelTree t(fur());
    return t;
}

/// Parallel rays, about a voxel apart, askew to the grid, tile by tile as a picture asks for them.
/// Index coordinates.
struct Rays {
    Vec3d direction = Vec3d(-0.3, -0.25, -0.9).unit();
    std::vector<Vec3d> origins;

    Rays()
    {
        const Vec3d right = direction.cross(Vec3d(0, 1, 0)).unit(), up = right.cross(direction);
        constexpr int kHalf = 128, kTile = 16;
        for (int y0 = -kHalf; y0 < kHalf; y0 += kTile)
            for (int x0 = -kHalf; x0 < kHalf; x0 += kTile)
                for (int y = y0; y < y0 + kTile; ++y)
                    for (int x = x0; x < x0 + kTile; ++x)
                        origins.push_back(-300.0 * direction + 1.03 * (x + 0.37) * right
                                          + 1.03 * (y + 0.71) * up);
    }
};
const Rays& rays()
{
    static const Rays r;
    return r;
}

/// Voxels (or cells) of leaves that the rays cross, empty ones too: what every method has to step
/// through.
template <class Tree>
double stepsThrough(const Tree& t, double shift)
{
    std::uint64_t steps = 0;
    for (const Vec3d& o : rays().origins) {
        const MarchRay r(t, o + Vec3d(shift), rays().direction, MarchRay::kFar);
        forEachLeaf(t, r, [&](const LeafSpan& span) {
            forEachVoxel(r, *span.start, [&](int, double, double) { ++steps; });
            return true;
        });
    }
    return double(steps);
}

void report(benchmark::State& state, double steps, double transmittance)
{
    state.counters["Msteps/s"] =
        benchmark::Counter(1e-6 * steps * double(state.iterations()), benchmark::Counter::kIsRate);
    state.counters["transmittance"] = transmittance / double(rays().origins.size());
}

/// The mean transmittance of the rays with a filter, through the library's own choice of
/// instructions.
void transmittance(benchmark::State& state, Filter filter)
{
    RenderParams params;
    params.filter = filter;
    params.cutoff = 0;
    params.tau = kExtinction;
    const MarchScene scene(tree(), {Material()}, {}, params);
    const double shift = scene.dual ? 0 : 0.5;
    double sum = 0;
    for (auto _ : state) {
        sum = 0;
        for (const Vec3d& o : rays().origins) {
            const Vec3d& d = rays().direction;
            const MarchRay r = scene.dual
                ? MarchRay(*scene.dual, o, d, MarchRay::kFar)
                : MarchRay(scene.tree, o + Vec3d(shift), d, MarchRay::kFar);
            sum += std::exp(-depthAlong(scene, r, d));
        }
    }
    report(state, scene.dual ? stepsThrough(*scene.dual, 0) : stepsThrough(tree(), shift), sum);
}
void boxTransmittance(benchmark::State& state) { transmittance(state, Filter::box); }
BENCHMARK(boxTransmittance)->Unit(benchmark::kMillisecond);
void trilinearTransmittance(benchmark::State& state) { transmittance(state, Filter::trilinear); }
BENCHMARK(trilinearTransmittance)->Unit(benchmark::kMillisecond);

/// As OpenVDB's own tools do it: depthOf(intersector, ray) for the rays that VolumeRayIntersector
/// lets through, moved by `shift`.
template <class F>
void openvdbTransmittance(benchmark::State& state, int dilation, const Vec3d& shift, double steps,
                          F&& depthOf)
{
    using Ray = openvdb::math::Ray<double>;
    openvdb::tools::VolumeRayIntersector<openvdb::FloatGrid,
                                         openvdb::FloatTree::LeafNodeType::LEVEL + 1, Ray>
        intersector(*fur().parts[0].density, dilation);
    double sum = 0;
    for (auto _ : state) {
        sum = 0;
        for (const Vec3d& o : rays().origins) {
            const Ray ray(o + shift, rays().direction);
            sum += intersector.setIndexRay(ray) ? std::exp(-kExtinction * depthOf(intersector, ray))
                                                : 1;
        }
    }
    report(state, steps, sum);
}

/// The box filter with DDA over voxels and an accessor. The steps are those of our walk, for
/// comparison.
void openvdbBoxTransmittance(benchmark::State& state)
{
    auto accessor = fur().parts[0].density->getConstAccessor();
    const Vec3d shift(0.5); // a voxel is [i, i + 1) to OpenVDB's DDA
    openvdbTransmittance(
        state, 0, shift, stepsThrough(tree(), 0.5), [&](auto& intersector, const auto& ray) {
            double depth = 0, t0, t1;
            while (intersector.march(t0, t1)) {
                openvdb::math::DDA<std::decay_t<decltype(ray)>, 0> dda(ray, t0, t1);
                do
                    depth += double(accessor.getValue(dda.voxel()))
                        * (std::min(dda.next(), t1) - dda.time());
                while (dda.step());
            }
            return depth;
        });
}
BENCHMARK(openvdbBoxTransmittance)->Unit(benchmark::kMillisecond);

/// The trilinear filter as vdb_render does it: fixed steps of one voxel with BoxSampler.
void openvdbTrilinearSteps(benchmark::State& state)
{
    auto accessor = fur().parts[0].density->getConstAccessor();
    openvdbTransmittance(state, 1, Vec3d(0.0), stepsThrough(DualTree(tree()), 0),
                         [&](auto& intersector, const auto& ray) {
                             double depth = 0, t0, t1;
                             while (intersector.march(t0, t1))
                                 for (double t = std::ceil(t0); t <= t1; ++t)
                                     depth += double(
                                         openvdb::tools::BoxSampler::sample(accessor, ray(t)));
                             return depth;
                         });
}
BENCHMARK(openvdbTrilinearSteps)->Unit(benchmark::kMillisecond);

/// A picture with three suns. Arguments: 0 shadow rays, 1 sweep; threads.
void shadows(benchmark::State& state)
{
    const ThreadLimit limit(static_cast<int>(state.range(1)));
    std::vector<Light> lights(3);
    lights[0].direction = Vec3d(-0.6, -0.7, -0.4).unit();
    lights[1].direction = Vec3d(0.8, -0.3, -0.5).unit();
    lights[2].direction = Vec3d(-0.2, -0.5, 0.85).unit();
    Camera camera;
    camera.eye = -300.0 * rays().direction;
    camera.target = Vec3d(0.0);
    camera.projection = Projection::orthographic;
    camera.width = 264;
    RenderParams params;
    params.width = params.height = 96;
    params.tau = kExtinction;
    params.shadows = state.range(0) ? Shadows::sweep : Shadows::exact;
    RenderStats stats;
    double mean = 0;
    for (auto _ : state) {
        const Image image = render(tree(), {}, camera, lights, params, {}, &stats);
        mean = 0;
        for (int y = 0; y < image.height; ++y)
            for (int x = 0; x < image.width; ++x)
                mean += image.pixel(x, y)[1] / (double(image.width) * image.height);
    }
    state.counters["Mvoxel-lights/s"] =
        benchmark::Counter(3e-6 * double(stats.shaded_voxels) * double(state.iterations()),
                           benchmark::Counter::kIsRate);
    state.counters["mean"] = mean;
}
BENCHMARK(shadows)
    ->Args({0, 1})
    ->Args({1, 1})
    ->Args({1, 2})
    ->UseRealTime()
    ->MeasureProcessCPUTime()
    ->Unit(benchmark::kMillisecond);

/// Argument: threads.
void treeBuilding(benchmark::State& state)
{
    const ThreadLimit limit(static_cast<int>(state.range(0)));
    for (auto _ : state) benchmark::DoNotOptimize(VoxelTree(fur()));
    state.counters["Mvoxel/s"] =
        benchmark::Counter(1e-6 * double(tree().voxelCount()) * double(state.iterations()),
                           benchmark::Counter::kIsRate);
}
BENCHMARK(treeBuilding)
    ->Arg(1)
    ->Arg(2)
    ->UseRealTime()
    ->MeasureProcessCPUTime()
    ->Unit(benchmark::kMillisecond);

/// The first coarser level; the ones after it cost a quarter to an eighth as much each.
void coarserLevel(benchmark::State& state)
{
    const ThreadLimit limit(static_cast<int>(state.range(0)));
    for (auto _ : state) benchmark::DoNotOptimize(VoxelTree::coarser(tree(), kExtinction));
    state.counters["Mvoxel/s"] =
        benchmark::Counter(1e-6 * double(tree().voxelCount()) * double(state.iterations()),
                           benchmark::Counter::kIsRate);
}
BENCHMARK(coarserLevel)
    ->Arg(1)
    ->Arg(2)
    ->UseRealTime()
    ->MeasureProcessCPUTime()
    ->Unit(benchmark::kMillisecond);

} // namespace

BENCHMARK_MAIN();
