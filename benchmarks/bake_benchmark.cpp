// SPDX-License-Identifier: Apache-2.0
// How fast boxes are grown and baked, in segments and voxels per second, and how much memory baking
// takes, as a multiple of its result.
#include <fstream>
#include <string>

#include <benchmark/benchmark.h>
#include <malloc.h>

#include "volcomp/bake/bake.h"

using namespace volcomp;

namespace {

const std::vector<Material> kMaterials = [] {
    Material fibre, leaf;
    fibre.name = "fibre";
    leaf.name = "leaf";
    leaf.kind = MaterialKind::surface;
    return std::vector<Material>{fibre, leaf};
}();

GrowthLevel stem(const std::string& name, const std::string& parent, double count, double length,
                 double radius)
{
    GrowthLevel l;
    l.name = name;
    l.parent = parent;
    l.count = {count, count};
    l.length = length;
    l.radius = radius;
    return l;
}

/// 2000 hairs of 12 pieces, 8 mm across.
GrowthRule tuft()
{
    GrowthRule p;
    p.name = "tuft";
    p.material = "fibre";
    GrowthLevel hair = stem("hair", "ground", 2000, 0.03, 40e-6);
    hair.spread = 0.004;
    hair.segments = 12;
    hair.angle = {0, 0.3};
    hair.wander = 0.2;
    p.levels = {hair};
    return p;
}

/// A tree of 10 m and about a million pieces, most of them leaves.
GrowthRule tree()
{
    GrowthRule p;
    p.name = "tree";
    p.material = "fibre";
    GrowthLevel trunk = stem("trunk", "ground", 1, 6, 0.3),
                bough = stem("bough", "trunk", 14, 4, 0), leaf = stem("leaf", "bough", 95, 0.1, 0);
    bough.radius_ratio = 0.45;
    bough.depth = 4;
    bough.fork = {6, 6};
    bough.start = 0.35;
    bough.angle = {0.8, 1.3};
    bough.wander = 0.5;
    bough.segments = 6;
    leaf.outline = Outline::ovate;
    leaf.material = "leaf";
    leaf.on_depth = {3, 4};
    leaf.angle = {0.7, 1.3};
    leaf.segments = 3;
    p.levels = {trunk, bough, leaf};
    return p;
}

std::size_t count(const Skeleton& skeleton)
{
    std::size_t sum = 0;
    for (const SkeletonPart& part : skeleton) sum += part.segments.size();
    return sum;
}

/// Returns a figure of /proc/self/status in bytes: VmRSS is the resident memory now, VmHWM its peak
/// since resetPeak().
double memoryOf(const char* key)
{
    std::ifstream status("/proc/self/status");
    for (std::string word; status >> word;)
        if (word == key) {
            double kilobytes = 0;
            status >> kilobytes;
            return 1024 * kilobytes;
        }
    return 0;
}

void resetPeak() { std::ofstream("/proc/self/clear_refs") << "5"; }

void growing(benchmark::State& state, const GrowthRule& p)
{
    std::size_t segments = 0;
    for (auto _ : state) segments += count(grow(p, 0));
    state.counters["segments"] = benchmark::Counter(double(segments) / double(state.iterations()));
    state.counters["segments_per_s"] =
        benchmark::Counter(double(segments), benchmark::Counter::kIsRate);
}

void baking(benchmark::State& state, GrowthRule p, double voxel)
{
    p.voxel = voxel;
    const double segments = double(count(grow(p, 0)));
    double voxels = 0, result = 0, ratio = 0;
    for (auto _ : state) {
        malloc_trim(0); // otherwise this run could take what earlier runs have freed
        const double before = memoryOf("VmRSS:");
        resetPeak();
        const Box box = bake(p, kMaterials, 0);
        const double peak = memoryOf("VmHWM:") - before;
        voxels = result = 0;
        for (const VolumePart& part : box.volume.parts) {
            voxels += double(part.density->activeVoxelCount());
            result += double(part.density->memUsage() + part.direction->memUsage()
                             + (part.colour ? part.colour->memUsage() : 0));
        }
        ratio = peak / result;
    }
    const double runs = double(state.iterations());
    state.counters["segments_per_s"] =
        benchmark::Counter(segments * runs, benchmark::Counter::kIsRate);
    state.counters["voxels_per_s"] = benchmark::Counter(voxels * runs, benchmark::Counter::kIsRate);
    state.counters["voxels"] = voxels;
    state.counters["result_MB"] = result / 1e6;
    state.counters["memory_ratio"] = ratio; // peak / result
}

BENCHMARK_CAPTURE(growing, tuft, tuft())->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime();
BENCHMARK_CAPTURE(growing, tree, tree())->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime();
BENCHMARK_CAPTURE(baking, tuft_0_2_mm, tuft(), 2e-4)
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime();
BENCHMARK_CAPTURE(baking, tuft_0_05_mm, tuft(), 5e-5)
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime();
BENCHMARK_CAPTURE(baking, tree_8_cm, tree(), 0.08)
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime();
BENCHMARK_CAPTURE(baking, tree_4_cm, tree(), 0.04)
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime();
BENCHMARK_CAPTURE(baking, tree_2_cm, tree(), 0.02)
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime();

} // namespace

BENCHMARK_MAIN();
