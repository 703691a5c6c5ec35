#include "shadow_sweep.h"

#include <cmath>

#include <gtest/gtest.h>

#include "integrator.h"
#include "march.h"
#include "random.h"

using namespace volcomp;

namespace {

Volume noise(int size, double fill, double brightest)
{
    VolumePart part;
    part.density = openvdb::FloatGrid::create(0.0f);
    Random random(5);
    for (int x = 0; x < size; ++x)
        for (int y = 0; y < size; ++y)
            for (int z = 0; z < size; ++z)
                if (random.uniform() < fill) part.density->tree().setValue({x - 9, y, z + 3}, float(brightest * random.uniform()));
    Volume volume;
    volume.parts.push_back(part);
    return volume;
}

Light from(Vec3d direction)
{
    Light light;
    direction.normalize();
    light.direction = direction;
    return light;
}

const Vec3d kDirections[] = {{-0.6, -0.7, -0.4}, {0.1, 0.2, -0.9}, {0.9, 0.1, 0.3}, {0, -1, 0}, {1, 1, 1}, {-1, 0, 1}, {0, 0, 1}};

// Optical depth from p by the sweep: marched to the plane, and what lies beyond.
double sweptDepth(const VoxelTree& tree, const ShadowSweep& sweep, const Vec3d& p, const Vec3d& L, double distance)
{
    const int cell[3] = {int(std::floor(p[0])), int(std::floor(p[1])), int(std::floor(p[2]))};
    double way = -1, beyond = -1;
    if (!sweep.toLight(0, cell, p, L, distance, way, beyond)) return -1;
    EXPECT_LE(way, 8 * std::sqrt(3.0) + 1e-9);
    const MarchRay r(tree, p, L, MarchRay::kFar);
    const double near = way > 0 ? shortIntegral<false>(tree, r.from(p, way), cell, L) : 0;
    EXPECT_NEAR(near, way > 0 ? lineIntegral<false>(tree, MarchRay(tree, p, L, way), L, MarchRay::kFar) : 0, 1e-6);
    return near + beyond;
}

} // namespace

// In a homogeneous block the depth is linear along the way to the light, which both ways to ask reproduce away from the edges.
TEST(ShadowSweep, IsExactInAHomogeneousBlock)
{
    for (const Vec3d& direction : kDirections) {
        Volume volume = noise(0, 0, 0);
        volume.parts[0].density->denseFill(openvdb::CoordBBox({0, 0, 0}, {31, 31, 31}), 0.1f, true);
        const VoxelTree tree(volume);
        const Light light = from(direction);
        const ShadowSweep sweep(tree, {light}, std::vector<float>(tree.leafCount(), 1), 1, 8, false);
        Random random(1);
        for (int i = 0; i < 200; ++i) {
            const Vec3d p(random.uniform(12, 20), random.uniform(12, 20), random.uniform(12, 20)), L = -light.direction;
            const int cell[3] = {int(p[0]), int(p[1]), int(p[2])};
            const double exact = lineIntegral<false>(tree, MarchRay(tree, p, L, MarchRay::kFar), Vec3d(0.0), MarchRay::kFar);
            // Codes are 0.02 apart at this depth; a kink where the nearest face changes costs the rest.
            EXPECT_NEAR(sweptDepth(tree, sweep, p, L, MarchRay::kFar), exact, 0.03) << direction;
            double passes = -1;
            bool fine = false;
            ASSERT_TRUE(sweep.roughLight(0, cell, p, L, MarchRay::kFar, passes, fine));
            EXPECT_TRUE(fine);
            EXPECT_NEAR(-std::log(passes), exact, 0.25) << direction;
        }
    }
}

// Light averaged over a volume of random voxels: no bias worth mentioning, and a small error of each query. A sun, points outside and
// inside the volume, and a spot.
TEST(ShadowSweep, AgreesWithRaysThroughNoise)
{
    std::vector<Light> lights;
    for (const Vec3d& direction : kDirections) lights.push_back(from(direction));
    for (const Vec3d& position : {Vec3d(60, 30, 20), Vec3d(10, 21, 22), Vec3d(-9.5, -30, 3)}) {
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
    const Volume volume = noise(40, 0.3, 0.2);
    const VoxelTree tree(volume);
    for (const Light& light : lights) {
        const ShadowSweep sweep(tree, {light}, std::vector<float>(tree.leafCount(), 1), 1, 8, false);
        Random random(2);
        double mean = 0, difference = 0, square = 0, rough_difference = 0, rough_square = 0;
        int count = 0, known = 0, rough_known = 0;
        while (count < 3000) {
            const Vec3d p(random.uniform(-9, 31), random.uniform(0, 40), random.uniform(3, 43));
            const int cell[3] = {int(std::floor(p[0])), int(p[1]), int(p[2])};
            const Vec3d way = tree.toCorner(light.position) - p;
            const bool sun = light.kind == LightKind::directional;
            const double distance = sun ? MarchRay::kFar : way.length();
            const Vec3d L = sun ? -light.direction : way / distance;
            if (!(tree.density(cell[0], cell[1], cell[2]) > 0) || !(illuminate(light, p - Vec3d(0.5), 0.5).weight > 0)) continue;
            ++count;
            const double exact = std::exp(-lineIntegral<false>(tree, MarchRay(tree, p, L, distance), Vec3d(0.0), MarchRay::kFar));
            mean += exact;
            const double depth = sweptDepth(tree, sweep, p, L, distance);
            if (depth >= 0) {
                ++known;
                difference += std::exp(-depth) - exact;
                square += (std::exp(-depth) - exact) * (std::exp(-depth) - exact);
            }
            double passes = -1;
            bool fine = false;
            if (sweep.roughLight(0, cell, p, L, distance, passes, fine)) {
                ++rough_known;
                rough_difference += passes - exact;
                rough_square += (passes - exact) * (passes - exact);
            }
        }
        const auto name = ::testing::Message() << light.direction << " " << light.position << " mean " << mean / count;
        mean /= count;
        EXPECT_GT(known, 0.97 * count) << name;
        EXPECT_GT(rough_known, 0.7 * count) << name; // not so close to a light that no plane lies before it
        EXPECT_NEAR(difference / known / mean, 0, 0.01) << name;
        EXPECT_LT(std::sqrt(square / known) / mean, 0.14) << name;
        EXPECT_NEAR(rough_difference / rough_known / mean, 0, 0.05) << name;
        EXPECT_LT(std::sqrt(rough_square / rough_known) / mean, 0.3) << name;
    }
}

// Pictures with swept light: every kind of light, both filters, fibres, sums; no ray to a light but from the border of what was marked.
TEST(ShadowSweep, PicturesAgreeWithThoseByRays)
{
    Volume volume = noise(40, 0.3, 0.3);
    volume.parts[0].direction = openvdb::Vec3SGrid::create(Vec3f(0.0f));
    volume.parts[0].kind = MaterialKind::fibre;
    Random random(7);
    for (auto v = volume.parts[0].density->cbeginValueOn(); v; ++v)
        volume.parts[0].direction->tree().setValue(v.getCoord(), Vec3f(Vec3d(random.normal(), random.normal(), random.normal()).unit()));
    const VoxelTree tree(volume);
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
        double limit;
    };
    for (const Case& c : {Case{Filter::box, Integration::exact, Extinction::isotropic, 0.03},
                          Case{Filter::box, Integration::exact, Extinction::fibre, 0.03},
                          Case{Filter::trilinear, Integration::exact, Extinction::isotropic, 0.05},
                          Case{Filter::box, Integration::riemann, Extinction::isotropic, 0.03}}) {
        RenderParams params;
        params.filter = c.filter;
        params.integration = c.integration;
        params.extinction = c.extinction;
        params.cutoff = 0;
        const Integrator exact(tree, {Material()}, lights, params);
        Integrator swept(tree, {Material()}, lights, params);
        const ShadowSweep sweep(tree, lights, std::vector<float>(tree.leafCount(), 1), swept.extinction(), swept.darkest(),
                                c.extinction == Extinction::fibre);
        swept.useSweep(sweep);
        Integrator::Scratch a, b;
        double mean = 0, square = 0, bias = 0;
        const int count = 300;
        for (int i = 0; i < count; ++i) {
            const Vec3d target(random.uniform(-9, 31), random.uniform(0, 40), random.uniform(3, 43)),
                d = Vec3d(random.normal(), random.normal(), random.normal()).unit();
            const double x = exact.trace(target - 100.0 * d, d, a).radiance[0], y = swept.trace(target - 100.0 * d, d, b).radiance[0];
            mean += x / count;
            bias += (y - x) / count;
            square += (y - x) * (y - x) / count;
        }
        EXPECT_LT(std::sqrt(square) / mean, c.limit) << int(c.filter) << int(c.integration) << int(c.extinction);
        EXPECT_NEAR(bias / mean, 0, 0.015);
        EXPECT_LT(b.counts.shadow_rays, a.counts.shadow_rays / 20) << a.counts.shadow_rays;
    }
}
