// SPDX-License-Identifier: Apache-2.0
// How fast placed boxes become a volume, beside OpenVDB's GridTransformer.
//
// The load: a box of 32 x 32 x 64 voxels with 60 strands (about 4,000 active voxels), placed on a
// unit sphere with a random turn and a scale of 0.8 to 1.2, at the box's own voxel size.
#include <benchmark/benchmark.h>

#include <cmath>

#include <openvdb/openvdb.h>
#include <openvdb/tools/Composite.h>
#include <openvdb/tools/GridTransformer.h>

#include "volcomp/compose/compose.h"
#include "volcomp/base/parallel.h"
#include "volcomp/base/random.h"

namespace {

using namespace volcomp;

constexpr double kVoxel = 0.001;

Box tuft()
{
    openvdb::initialize();
    Box box{"tuft", 0, {}};
    VolumePart part;
    part.material = "fur";
    const auto transform = openvdb::math::Transform::createLinearTransform(kVoxel);
    part.density = openvdb::FloatGrid::create(0.0f);
    part.direction = openvdb::Vec3SGrid::create(openvdb::Vec3s(0.0f));
    part.colour = openvdb::Vec3SGrid::create(openvdb::Vec3s(0.0f));
    part.density->setTransform(transform);
    part.direction->setTransform(transform);
    part.colour->setTransform(transform);
    for (int s = 0; s < 60; ++s) {
        Random r(hashKey(1, s));
        double x = r.uniform(-14, 14), z = r.uniform(-14, 14), dx = r.symmetric() * 0.1,
               dz = r.symmetric() * 0.1;
        for (int y = 0; y < 64; ++y) {
            Vec3f t(float(dx), 1, float(dz));
            t.normalize();
            const openvdb::Coord c(int(std::lround(x)), y, int(std::lround(z)));
            part.density->tree().setValue(c, 300.0f);
            part.direction->tree().setValue(c, t);
            part.colour->tree().setValue(c, Vec3f(0.5f, 0.3f, float(s) / 60));
            x = std::min(15.0, std::max(-16.0, x + dx)),
            z = std::min(15.0, std::max(-16.0, z + dz));
        }
    }
    box.volume.parts.push_back(part);
    return box;
}

std::vector<Placement> onSphere(int count)
{
    std::vector<Placement> placements;
    for (int k = 0; k < count; ++k) {
        Random r(hashKey(2, k));
        Vec3d n(r.normal(), r.normal(), r.normal());
        n.normalize();
        const Vec3d a = n.cross(std::abs(n[0]) < 0.5 ? Vec3d(1, 0, 0) : Vec3d(0, 1, 0)).unit(),
                    b = n.cross(a);
        const double turn = r.uniform(0, 2 * kPi);
        const Vec3d x = a * std::cos(turn) + b * std::sin(turn);
        Placement p;
        p.x_axis = Vec3f(x);
        p.y_axis = Vec3f(n);
        p.z_axis = Vec3f(x.cross(n));
        p.position = n;
        p.scale = float(r.uniform(0.8, 1.2));
        p.tint = Vec3f(float(r.uniform(0.5, 1)), 1, 1);
        placements.push_back(p);
    }
    return placements;
}

/// Argument: threads. Density, direction and colour.
void composeOnSphere(benchmark::State& state)
{
    const ThreadLimit limit(static_cast<int>(state.range(0)));
    const std::vector<Box> boxes{tuft()};
    const auto placements = onSphere(2000);
    ComposeParams params;
    params.voxel = kVoxel;
    std::size_t voxels = 0, bytes = 0;
    for (auto _ : state) {
        const PackedVolume v = compose(boxes, placements, params);
        state.PauseTiming();
        voxels = v.voxels();
        bytes = v.bytes();
        state.ResumeTiming();
    }
    state.counters["placements/s"] =
        benchmark::Counter(2000.0 * double(state.iterations()), benchmark::Counter::kIsRate);
    state.counters["Mvoxel"] = double(voxels) / 1e6;
    state.counters["MB"] = double(bytes) / 1048576;
}
BENCHMARK(composeOnSphere)
    ->Arg(1)
    ->Arg(2)
    ->UseRealTime()
    ->MeasureProcessCPUTime()
    ->Unit(benchmark::kMillisecond);

/// The same load through OpenVDB: each box resampled by GridTransformer and summed, density alone.
void gridTransformerOnSphere(benchmark::State& state)
{
    const ThreadLimit limit(static_cast<int>(state.range(0)));
    const Box box = tuft();
    const int count = 40;
    const auto placements = onSphere(count);
    for (auto _ : state) {
        openvdb::FloatGrid::Ptr sum = openvdb::FloatGrid::create(0.0f);
        for (const Placement& p : placements) {
            openvdb::Mat4R m = openvdb::Mat4R::identity();
            const Vec3f* axes[3] = {&p.x_axis, &p.y_axis, &p.z_axis};
            for (int a = 0; a < 3; ++a) // vectors are rows in OpenVDB
                for (int i = 0; i < 3; ++i) m[a][i] = (*axes[a])[i] * p.scale;
            m.setTranslation(p.position / kVoxel);
            openvdb::FloatGrid::Ptr out = openvdb::FloatGrid::create(0.0f);
            openvdb::tools::GridTransformer transformer(m);
            transformer.transformGrid<openvdb::tools::BoxSampler, openvdb::FloatGrid>(
                *box.volume.parts[0].density, *out);
            openvdb::tools::compSum(*sum, *out);
        }
        benchmark::DoNotOptimize(sum);
    }
    state.counters["placements/s"] =
        benchmark::Counter(double(count) * double(state.iterations()), benchmark::Counter::kIsRate);
}
BENCHMARK(gridTransformerOnSphere)
    ->Arg(1)
    ->UseRealTime()
    ->MeasureProcessCPUTime()
    ->Unit(benchmark::kMillisecond);

/// A million boxes of about 20 voxels: memory must stay bounded.
void millionSmallBoxes(benchmark::State& state)
{
    Box box{"dot", 0, {}};
    VolumePart part = tuft().volume.parts[0];
    part.density = openvdb::FloatGrid::create(0.0f);
    part.density->setTransform(openvdb::math::Transform::createLinearTransform(kVoxel));
    for (int y = 0; y < 20; ++y) part.density->tree().setValue(openvdb::Coord(0, y, 0), 100.0f);
    box.volume.parts.push_back(part);
    const auto placements = onSphere(1000000);
    ComposeParams params;
    params.voxel = 4 * kVoxel;
    for (auto _ : state) benchmark::DoNotOptimize(compose({box}, placements, params));
    state.counters["placements/s"] =
        benchmark::Counter(1e6 * double(state.iterations()), benchmark::Counter::kIsRate);
}
BENCHMARK(millionSmallBoxes)->UseRealTime()->MeasureProcessCPUTime()->Unit(benchmark::kMillisecond);

} // namespace

BENCHMARK_MAIN();
