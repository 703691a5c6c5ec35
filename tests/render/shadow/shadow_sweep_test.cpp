// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/shadow/shadow_sweep.h"

#include <cmath>

#include <gtest/gtest.h>

#include "volcomp/render/march/integrator.h"
#include "volcomp/render/march/march.h"
#include "volcomp/base/random.h"
#include "tests/render/shadow/swept_rays.h"
#include "tests/support/volumes.h"

using namespace volcomp;

namespace {

Volume noise(int size, double fill, double brightest)
{
    Volume volume = emptyVolume();
    Random random(5);
    for (int x = 0; x < size; ++x)
        for (int y = 0; y < size; ++y)
            for (int z = 0; z < size; ++z)
                if (random.uniform() < fill)
                    volume.parts[0].density->tree().setValue({x - 9, y, z + 3},
                                                             float(brightest * random.uniform()));
    return volume;
}

Light from(Vec3d direction)
{
    Light light;
    direction.normalize();
    light.direction = direction;
    return light;
}

constexpr double kFarAway = 1e30;
const Vec3d kDirections[] = {{-0.6, -0.7, -0.4}, {0.1, 0.2, -0.9}, {0.9, 0.1, 0.3}, {0, -1, 0},
                             {1, 1, 1},          {-1, 0, 1},       {0, 0, 1}};

// Optical depth from p to light 0 by the sweep: marched to the plane, and what lies beyond; -1 if
// the sweep does not know it. `of_cell` is the voxel that p counts to, if not the one it lies in.
double sweptDepth(const VoxelTree& tree, const ShadowSweep& sweep, const Vec3d& p, const Vec3d& L,
                  double distance, const int* of_cell = nullptr)
{
    int cell[3];
    for (int a = 0; a < 3; ++a) cell[a] = of_cell ? of_cell[a] : int(std::floor(p[a]));
    const auto path = sweep.pathToLight(0, cell, p, L, distance);
    if (!path) return -1;
    const double way = path->march;
    EXPECT_LE(way, 8 * std::sqrt(3.0) + 1e-9);
    const MarchRay r(tree, p, L, MarchRay::kFar);
    const double near = way > 0 ? shortIntegral<false>(tree, r.from(p, way), cell, L) : 0;
    EXPECT_NEAR(
        near, way > 0 ? lineIntegral<false>(tree, MarchRay(tree, p, L, way), L, MarchRay::kFar) : 0,
        1e-6);
    return near + path->beyond;
}

std::vector<Light> lightsOfEveryKind()
{
    std::vector<Light> lights;
    for (const Vec3d& direction : kDirections) lights.push_back(from(direction));
    for (const Vec3d& position : {Vec3d(60, 30, 20), Vec3d(10, 21, 22),
                                  Vec3d(-9.5, -30, 3)}) { // outside and inside the volume
        Light light;
        light.kind = LightKind::point;
        light.position = position;
        lights.push_back(light);
    }
    Light spot = from(Vec3d(-1, -0.3, 0.2));
    spot.kind = LightKind::spot;
    spot.position = {60, 30, 20};
    spot.angle = 0.4;
    lights.push_back(spot);
    return lights;
}

Volume fibres(Volume volume)
{
    Random random(7);
    volume.parts[0].direction = openvdb::Vec3SGrid::create(Vec3f(0.0f));
    volume.parts[0].kind = MaterialKind::fibre;
    for (auto v = volume.parts[0].density->cbeginValueOn(); v; ++v)
        volume.parts[0].direction->tree().setValue(
            v.getCoord(), Vec3f(Vec3d(random.normal(), random.normal(), random.normal()).unit()));
    return volume;
}

/// A random place in a volume noise(40, ...) and the way from there to a light.
struct Query {
    Vec3d p, L;
    int cell[3];
    double distance;

    Query(const VoxelTree& tree, const Light& light, Random& random)
        : p(random.uniform(-9, 31), random.uniform(0, 40), random.uniform(3, 43)),
          cell{int(std::floor(p[0])), int(p[1]), int(p[2])}
    {
        const Vec3d way = tree.toCorner(light.position) - p;
        const bool sun = light.kind == LightKind::directional;
        distance = sun ? MarchRay::kFar : way.length();
        L = sun ? -light.direction : way / distance;
    }
};

} // namespace

// The sweep keeps the root of each ray's exact transmittance. A code is off by 0.6 at most: 0.5 by
// rounding and 0.1 by the exponential.
TEST(ShadowSweep, KeepsTheTransmittanceOfExactRays)
{
    std::vector<Light> lights = lightsOfEveryKind();
    lights.pop_back(); // a spot has a point's rays, but its cone decides how far apart they are
    for (const double dense : {0.2, 0.7})
        for (const bool directed : {false, true}) {
            const VoxelTree tree(fibres(noise(40, 0.3, dense)));
            for (const Light& light : lights) {
                const ShadowSweep sweep(tree, {light}, std::vector<float>(tree.leafCount(), 1), 1,
                                        12, directed);
                Random random(3);
                int fine_known = 0, rough_known = 0;
                for (int i = 0; i < 150; ++i) {
                    const Query q(tree, light, random);
                    const SweptRays rays(tree, light, q.L, directed);
                    const double s = rays.planeBefore(q.cell), expected_way = rays.way(q.p, s);
                    const auto name = ::testing::Message()
                        << light.direction << light.position << " at " << q.p << dense << directed;
                    if (const auto path = sweep.pathToLight(0, q.cell, q.p, q.L, q.distance)) {
                        const bool near = !rays.startsBefore(s) || expected_way >= q.distance;
                        ASSERT_NEAR(path->march, near ? q.distance : expected_way, 1e-9) << name;
                        ASSERT_NEAR(255 * std::exp(-0.5 * path->beyond),
                                    near ? 255 : rays.code(q.p, s, 1), 0.6)
                            << name;
                        ++fine_known;
                    }
                    if (const auto light_here =
                            sweep.approximateTransmittance(0, q.cell, q.p, q.L, q.distance)) {
                        const double part = expected_way / (expected_way - rays.way(q.p, s + 8));
                        ASSERT_NEAR(255 * std::sqrt(light_here->value),
                                    (1 - part) * rays.code(q.p, s, 3)
                                        + part * rays.code(q.p, s + 8, 3),
                                    0.6)
                            << name;
                        ++rough_known;
                    }
                }
                EXPECT_GT(fine_known, dense < 0.5 ? 140 : 30) << light.direction << light.position;
                EXPECT_GT(rough_known, 100) << light.direction << light.position;
            }
        }
}

// In a homogeneous block the depth is linear along the way to the light. Both ways to ask reproduce
// that away from the edges.
TEST(ShadowSweep, IsExactInAHomogeneousBlock)
{
    for (const Vec3d& direction : kDirections) {
        Volume volume = emptyVolume();
        volume.parts[0].density->denseFill(openvdb::CoordBBox({0, 0, 0}, {31, 31, 31}), 0.1f, true);
        const VoxelTree tree(volume);
        const Light light = from(direction);
        const ShadowSweep sweep(tree, {light}, std::vector<float>(tree.leafCount(), 1), 1, 8,
                                false);
        Random random(1);
        for (int i = 0; i < 200; ++i) {
            const Vec3d p(random.uniform(12, 20), random.uniform(12, 20), random.uniform(12, 20)),
                L = -light.direction;
            const int cell[3] = {int(p[0]), int(p[1]), int(p[2])};
            const double exact = lineIntegral<false>(tree, MarchRay(tree, p, L, MarchRay::kFar),
                                                     Vec3d(0.0), MarchRay::kFar);
            // The depth is the least of linear functions, one for each face by which light may
            // enter. Between rays h apart a kink costs at most h / 4 times the change of slope,
            // along both axes. A code, 255 times the root, is off by 0.6 at most.
            double enters[3], least = kFarAway, greatest_L = 0;
            for (int a = 0; a < 3; ++a) {
                enters[a] = std::abs(L[a]) < 1e-9
                    ? kFarAway
                    : ((L[a] > 0 ? 32 - p[a] : p[a])) / std::abs(L[a]);
                least = std::min(least, enters[a]);
                greatest_L = std::max(greatest_L, std::abs(L[a]));
            }
            const auto kinks = [&](double h) {
                double sum = 0;
                int faces = 0;
                for (int a = 0; a < 3; ++a)
                    if (enters[a] - h / std::max(std::abs(L[a]), 1e-9) <= least + h / greatest_L)
                        ++faces, sum += h / 4 * 0.1 / std::abs(L[a]);
                return faces > 1 ? sum : 0;
            };
            const double rounding = 2 * 0.6 / (255 * std::exp(-0.5 * exact));
            EXPECT_NEAR(sweptDepth(tree, sweep, p, L, MarchRay::kFar), exact,
                        kinks(ShadowSweep::kSpacing) + rounding)
                << direction;
            const auto rough = sweep.approximateTransmittance(0, cell, p, L, MarchRay::kFar);
            ASSERT_TRUE(rough);
            EXPECT_TRUE(rough->fine);
            // The rays are 2 voxels apart and the planes 8; between planes the root is linear.
            EXPECT_NEAR(-std::log(rough->value), exact,
                        kinks(2) + std::pow(0.1 * 8 / greatest_L, 2) / 16 + rounding)
                << direction;
        }
    }
}

// Compares the light in a volume of random voxels with that by rays. The limits follow from the
// statistics of independent voxels of variance v.
//
// A ray along an axis has the depth of its column of voxels; rays h apart may stand in different
// columns. The depth is read between four rays. At random places n voxels from the light, its
// squared difference from the true depth is v n k in the mean. Along one axis, for h = 2/3, the
// mean weight of the rays in the point's own column is 7/9, and so is the mean sum of the squared
// weights of all columns: k = 1 - (7/9)^2. For h = 2 these are 5/12 and 2/3: k = 1 - 2 (5/12)^2 +
// (2/3)^2. Oblique rays cross and share more voxels, so their k is smaller. What is read is the
// mean of the roots. It is too small by about (1 - q) v n / 4 of the light; q is the sum of the
// squared weights.
TEST(ShadowSweep, AgreesWithRaysThroughNoise)
{
    const double fill = 0.3, brightest = 0.2,
                 v = fill * brightest * brightest / 3 - std::pow(fill * brightest / 2, 2);
    const double k_fine = 1 - 49.0 / 81, q_fine = 49.0 / 81, k_rough = 1 - 2 * 25.0 / 144 + 4.0 / 9,
                 q_rough = 4.0 / 9;
    const Volume volume = noise(40, fill, brightest);
    const VoxelTree tree(volume);
    for (const Light& light : lightsOfEveryKind()) {
        const ShadowSweep sweep(tree, {light}, std::vector<float>(tree.leafCount(), 1), 1, 8,
                                false);
        Random random(2);
        struct Sums {
            double mean = 0, difference = 0, square = 0, expected = 0, bias = 0; ///< of the light
            int known = 0;
            void add(double found, double exact, double vn, double k, double q)
            {
                ++known;
                mean += exact;
                difference += found - exact;
                square += (found - exact) * (found - exact);
                expected += exact * exact * vn * k;
                bias += exact * (1 - q) * vn / 4;
            }
            void check(int columns) const // the number of independent ones
            {
                const double limit = std::sqrt(expected / known) / (mean / known);
                EXPECT_LT(std::sqrt(square / known) / (mean / known),
                          1.1 * limit); // a tenth for the exponential's curvature and chance
                EXPECT_NEAR(difference / mean, -bias / mean,
                            4 * limit / std::sqrt(columns)); // four standard errors
            }
        } fine, rough;
        int count = 0, unknown = 0;
        while (count < 3000) {
            const Query q(tree, light, random);
            if (!(illuminate(light, q.p - Vec3d(0.5), 0.5).weight > 0))
                continue; // outside of the spot's cone
            ++count;
            const MarchRay r(tree, q.p, q.L, q.distance);
            const double exact =
                             std::exp(-lineIntegral<false>(tree, r, Vec3d(0.0), MarchRay::kFar)),
                         vn = v * (r.t1 - r.t0);
            const double depth = sweptDepth(tree, sweep, q.p, q.L, q.distance);
            if (depth >= 0) {
                const double way = sweep.pathToLight(0, q.cell, q.p, q.L, q.distance)->march;
                fine.add(std::exp(-depth), exact, v * std::max(0.0, r.t1 - r.t0 - way), k_fine,
                         q_fine);
            }
            if (const auto found = sweep.approximateTransmittance(0, q.cell, q.p, q.L, q.distance))
                rough.add(found->value, exact, vn, k_rough, q_rough);
            else unknown += depth < 0;
        }
        SCOPED_TRACE(::testing::Message() << light.direction << " " << light.position);
        EXPECT_EQ(unknown, 0);
        EXPECT_GT(fine.known, 0.97 * count);
        // Unknown are places so close to a light that no plane lies between.
        EXPECT_GT(rough.known, 0.7 * count);
        fine.check(40 * 40);
        rough.check(20 * 20);
    }
}

// Light is bright before everything, and stays dark where it has become dark.
TEST(ShadowSweep, EndsInTheDark)
{
    Volume volume = emptyVolume();
    volume.parts[0].density->denseFill(openvdb::CoordBBox({0, 0, 0}, {15, 15, 63}), 0.5f, true);
    const VoxelTree tree(volume);
    const Light light = from({0, 0, 1});
    const ShadowSweep sweep(tree, {light}, std::vector<float>(tree.leafCount(), 1), 1, 12, false);
    // The first plane is bright; planes are rough from 5.5 voxels on and dark from 24 voxels on.
    for (const int z : {0, 5, 15, 30, 47, 55, 60}) {
        const int cell[3] = {7, 8, z};
        const Vec3d p(7.5, 8.4, z + 0.5);
        const Vec3d L = -light.direction;
        const auto rough = sweep.approximateTransmittance(0, cell, p, L, MarchRay::kFar);
        ASSERT_TRUE(rough);
        if (z > 40) {
            EXPECT_LE(rough->value, std::exp(-12.0)) << z;
        }
        if (z < 32) {
            const double plane = z & ~7, root = std::exp(-0.25 * plane),
                         behind = std::exp(-0.25 * (plane + 8)), part = (p[2] - plane) / 8;
            EXPECT_NEAR(255 * std::sqrt(rough->value), 255 * (root + (behind - root) * part), 0.6)
                << z;
        }
        const auto path = sweep.pathToLight(0, cell, p, L, MarchRay::kFar);
        if (!path) continue;
        const double depth = path->beyond;
        EXPECT_TRUE(z < 8 ? depth == 0
                        : z > 40
                        ? depth >= 12
                        : std::abs(255 * std::exp(-0.5 * depth) - 255 * std::exp(-0.25 * (z & ~7)))
                            < 0.6)
            << z << " " << depth;
    }
}

// The light is marched to the plane as exactly as without a sweep, with each filter and extinction.
TEST(ShadowSweep, TheWayToThePlaneIsExact)
{
    const VoxelTree tree(fibres(noise(40, 0.3, 0.2)));
    std::vector<Light> lights = lightsOfEveryKind();
    for (const Filter filter : {Filter::box, Filter::trilinear})
        for (const Extinction extinction : {Extinction::isotropic, Extinction::directed}) {
            RenderParams params;
            params.filter = filter;
            params.extinction = extinction;
            params.cutoff = 0;
            const Integrator plain(tree, {Material()}, {}, params);
            params.filter = Filter::box;
            const Integrator box(tree, {Material()}, {}, params);
            params.filter = filter;
            Integrator swept(tree, {Material()}, lights, params);
            const ShadowSweep sweep(tree, lights, std::vector<float>(tree.leafCount(), 1), 1, 12,
                                    extinction == Extinction::directed);
            swept.useSweep(sweep);
            RayCounts counts;
            Integrator::Scratch scratch;
            Random random(4);
            int known = 0;
            for (int i = 0; i < 1000; ++i) {
                const std::size_t l = i % lights.size();
                const Query q(tree, lights[l], random);
                const auto path =
                    sweep.pathToLight(l, q.cell, q.p, q.L, q.distance, filter == Filter::trilinear);
                if (!path) continue;
                ++known;
                // With the trilinear filter to the next layer of centres, of which `beyond` has the
                // depth with the box filter.
                double more = 0, boxed = 0;
                if (filter == Filter::trilinear && path->beyond < 12) {
                    more =
                        std::min(0.5 / std::abs(q.L[largestAxis(q.L)]), q.distance - path->march);
                    RaySample far, further;
                    box.traceFurther(far, q.p - Vec3d(0.5), q.L, 0, path->march + more, scratch);
                    box.traceFurther(further, q.p - Vec3d(0.5), q.L, 0, path->march, scratch);
                    boxed = std::log(further.transmittance / far.transmittance);
                }
                RaySample near;
                plain.traceFurther(near, q.p - Vec3d(0.5), q.L, 0, path->march + more, scratch);
                ASSERT_NEAR(swept.depthToLight(l, q.cell, q.p, counts),
                            std::max(0.0, path->beyond - boxed) - std::log(near.transmittance),
                            1e-6)
                    << int(filter) << int(extinction) << q.p << l;
            }
            EXPECT_GT(known, 800);
        }
}

// The radiance along rays, segment by segment, from what the sweep says. A segment that is a trace
// in its pixel, or lies in shade, takes the approximate light at the middle of what it shows;
// others come near the sum over many places in them.
TEST(ShadowSweep, SegmentsTakeWhatTheyAreWorth)
{
    const VoxelTree tree(noise(40, 0.3, 0.3));
    const Light light = from({-0.6, -0.7, -0.4});
    Material material;
    RenderParams params;
    params.cutoff = 0;
    Integrator integrator(tree, {material}, {light}, params);
    const ShadowSweep sweep(tree, {light}, std::vector<float>(tree.leafCount(), 1), 1, 12, false);
    integrator.useSweep(sweep);
    const Vec3d L = -light.direction;
    const double S = material.alpha / 4;
    Random random(8);
    Integrator::Scratch scratch;
    for (int i = 0; i < 100; ++i) {
        const Vec3d target(random.uniform(-9, 31), random.uniform(0, 40), random.uniform(3, 43)),
            d = Vec3d(random.normal(), random.normal(), random.normal()).unit(),
            o = target - 100.0 * d; // corner coordinates
        const MarchRay r(tree, o, d, MarchRay::kFar);
        std::vector<float> greatest(tree.leafCount()), marked(tree.leafCount());
        double radiance = 0, T = 1, passes = 0, passes_t = -kFarAway, sent = 0;
        bool fine = false;
        forEachLeaf(tree, r, [&](const LeafSpan& span) {
            forEachVoxel(r, *span.start, [&](int voxel, double t, double end) {
                const double delta = tree.densities(span.leaf)[voxel] * (end - t),
                             weight = T * -std::expm1(-delta);
                if (!(delta > 0)) return;
                const int cell[3] = {span.cell[0] + (voxel >> 6), span.cell[1] + (voxel >> 3 & 7),
                                     span.cell[2] + (voxel & 7)};
                const auto at = [&](double v) {
                    return o + (t - std::log1p(v * std::expm1(-delta)) / delta * (end - t)) * d;
                };
                greatest[span.leaf] = std::max(greatest[span.leaf], float(weight));
                if (weight >= 0.001
                    || std::abs(t - passes_t) > 2) { // a trace takes the light of a neighbour
                    const auto rough =
                        sweep.approximateTransmittance(0, cell, at(0.5), L, MarchRay::kFar);
                    ASSERT_TRUE(rough);
                    passes = rough->value;
                    fine = rough->fine;
                    passes_t = t;
                }
                if (!fine || weight * passes < ShadowSweep::kFineWeight)
                    radiance += weight * passes * S;
                else {
                    constexpr int kPlaces = 64;
                    for (int n = 0; n < kPlaces; ++n) {
                        const Vec3d x = at((n + 0.5) / kPlaces);
                        const double swept = sweptDepth(tree, sweep, x, L, MarchRay::kFar, cell),
                                     depth = swept >= 0
                            ? swept
                            : lineIntegral<false>(tree, MarchRay(tree, x, L, MarchRay::kFar), L,
                                                  kFarAway);
                        sent += weight * std::exp(-depth) * S / kPlaces;
                    }
                }
                T *= std::exp(-delta);
            });
            return true;
        });
        ASSERT_NEAR(integrator.trace(o - Vec3d(0.5), d, scratch).radiance[0], radiance + sent,
                    1e-5 * radiance + 0.06 * sent + 1e-9)
            << o << d;
        integrator.markLeaves(o - Vec3d(0.5), d, 0, 1000, 0, marked);
        for (std::size_t leaf = 0; leaf < marked.size(); ++leaf)
            ASSERT_NEAR(marked[leaf], greatest[leaf], 1e-5) << leaf;
    }
}

// Pictures with swept light, with every kind of light, both filters, fibres and sums. Rays to
// lights start only at the border of what was marked.
//
// The limits follow from the statistics of AgreesWithRaysThroughNoise. Light of transmittance e^-D
// has crossed n = D / m voxels of mean density m and variance v. Read between columns, it is off by
// e^-D sqrt(v n k) and too dark by the part (1 - q) v n / 4. Fine light has k = 1 - 49/81 and
// q = 49/81; rough light has k = 1.1 and q = 4/9. The trilinear filter reads between columns
// itself, with q = 4/9: k is at most the sum of both q, and its light is darker than that of single
// columns by the part (1 - 4/9) v n / 2. A pixel adds up the light of its segments, whose errors
// are independent if their ways to the light have no voxel in common. Few have: a segment is about
// a voxel long, and the next one that is not empty is about three voxels on.
TEST(ShadowSweep, PicturesAgreeWithThoseByRays)
{
    const double fill = 0.3, densest = 0.3, m = fill * densest / 2,
                 v = fill * densest * densest / 3 - m * m;
    const double q_fine = 49.0 / 81, q_rough = 4.0 / 9, q_trilinear = 4.0 / 9;
    const VoxelTree tree(fibres(noise(40, fill, densest)));
    Random random(7);
    std::vector<Light> lights{from({-0.6, -0.7, -0.4}), from({0, -1, 0}), from({-1, 0, 0})};
    lights[1].kind = LightKind::point;
    lights[1].position = {10, 60, 20};
    lights[1].strength = Vec3d(1600.0);
    lights[2].kind = LightKind::spot;
    lights[2].position = {60, 20, 20};
    lights[2].angle = 0.7;
    lights[2].strength = Vec3d(1600.0);
    struct Case {
        Filter filter;
        Integration integration;
        Extinction extinction;
    };
    for (const Case& c : {Case{Filter::box, Integration::exact, Extinction::isotropic},
                          Case{Filter::box, Integration::exact, Extinction::directed},
                          Case{Filter::trilinear, Integration::exact, Extinction::isotropic},
                          Case{Filter::box, Integration::riemann, Extinction::isotropic}}) {
        RenderParams params;
        params.filter = c.filter;
        params.integration = c.integration;
        params.extinction = c.extinction;
        params.cutoff = 0;
        const Integrator exact(tree, {Material()}, lights, params);
        Integrator swept(tree, {Material()}, lights, params);
        const ShadowSweep sweep(tree, lights, std::vector<float>(tree.leafCount(), 1),
                                swept.extinction(), swept.darkest(),
                                c.extinction == Extinction::directed);
        swept.useSweep(sweep);
        Integrator::Scratch a, b;
        double square = 0, bias = 0, expected_square = 0, darker = 0, brighter = 0;
        const bool trilinear = c.filter == Filter::trilinear;
        const RayObserver observer = [&](const SeenSegment& segment) {
            for (const SeenLight& light : segment.lights) {
                const double vn = v * -std::log(light.transmittance) / m, r = light.radiance[0];
                const bool fine = c.integration == Integration::riemann
                    || segment.weight * light.transmittance >= ShadowSweep::kFineWeight;
                const double q = fine ? q_fine : q_rough,
                             k = trilinear ? q + q_trilinear
                    : fine                 ? 1 - q_fine
                                           : 1.1;
                expected_square += r * r * vn * k;
                darker += r * (1 - q) * vn / 4;
                brighter += trilinear ? r * (1 - q_trilinear) * vn / 2 : 0;
            }
        };
        a.observer = &observer;
        const int count = 300;
        for (int i = 0; i < count; ++i) {
            const Vec3d target(random.uniform(-9, 31), random.uniform(0, 40),
                               random.uniform(3, 43)),
                d = Vec3d(random.normal(), random.normal(), random.normal()).unit();
            const double x = exact.trace(target - 100.0 * d, d, a).radiance[0],
                         y = swept.trace(target - 100.0 * d, d, b).radiance[0];
            bias += y - x;
            square += (y - x) * (y - x);
        }
        SCOPED_TRACE(::testing::Message()
                     << int(c.filter) << int(c.integration) << int(c.extinction));
        EXPECT_LT(square, expected_square);
        const double chance = 4 * std::sqrt(expected_square); // four standard errors of the sum
        EXPECT_LT(bias, brighter + chance);
        EXPECT_GT(bias, -darker - chance);
        EXPECT_LT(b.counts.shadow_rays, a.counts.shadow_rays / 20) << a.counts.shadow_rays;
    }
}
