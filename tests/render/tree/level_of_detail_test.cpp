#include "volcomp/render/tree/level_of_detail.h"

#include <cmath>

#include <gtest/gtest.h>

#include "volcomp/render/march/march.h"
#include "volcomp/base/random.h"
#include "volcomp/render/render.h"
#include "tests/support/volumes.h"

using namespace volcomp;

namespace {

Volume noise(int size, double fill, double most)
{
    Volume volume = emptyVolume();
    Random random(3);
    for (int x = 0; x < size; ++x)
        for (int y = 0; y < size; ++y)
            for (int z = 0; z < size; ++z)
                if (random.uniform() < fill)
                    volume.parts[0].density->tree().setValue({x - 5, y, z - 16},
                                                             float(most * random.uniform()));
    return volume;
}

const std::array<VoxelTree::ScatterRatio, 8> kEven = [] {
    std::array<VoxelTree::ScatterRatio, 8> scatter_ratio;
    scatter_ratio.fill({1, 1, 1});
    return scatter_ratio;
}();
/// noise(64, ...) at eight voxels a pixel, without a cutoff.
Image fromAfar(const VoxelTree& tree, const Light& light, int samples, bool lod)
{
    Camera camera;
    camera.eye = {27, 32, 500};
    camera.target = {27, 32, 0};
    camera.field_of_view = 0.2;
    RenderParams params;
    params.width = params.height = 14;
    params.cutoff = 0;
    params.samples = samples;
    params.lod = lod;
    return render(tree, {}, camera, {light}, params);
}

double coarserDensity(const double* densities, double extinction)
{
    return coarserVoxel(densities, kEven.data(), extinction).density;
}

} // namespace

TEST(VoxelTree, CoarserDensityKeepsTheMeanTransmittanceOfColumns)
{
    const double same[8] = {2, 2, 2, 2, 2, 2, 2, 2};
    EXPECT_NEAR(coarserDensity(same, 0.3), 2, 1e-12);
    EXPECT_NEAR(coarserDensity(same, 0), 2, 1e-12);
    const double opaque[8] = {1e6, 1e6, 1e6, 1e6, 1e6, 1e6, 1e6, 1e6};
    EXPECT_NEAR(coarserDensity(opaque, 1), 1e6, 1);
    // A wall across x: opaque along it, half the columns open along the others.
    const double wall[8] = {3, 3, 3, 3, 0, 0, 0, 0};
    const double across = std::log(2 / (1 + std::exp(-6.0))) / 2;
    EXPECT_NEAR(coarserDensity(wall, 1), (1.5 + 2 * across) / 3, 1e-12);
    const double one[8] = {1e-9, 0, 0, 0, 0, 0, 0, 0};
    EXPECT_NEAR(coarserDensity(one, 1), 1e-9 / 8, 1e-18);
}

// Single scattering in eight voxels, by beams cut into many, against that of the coarser voxel
// times what it shows.
TEST(VoxelTree, CoarserVoxelsShowTheLightThatTheirPartsShow)
{
    Random random(11);
    for (int n = 0; n < 20; ++n) {
        double depths[8];
        for (double& d : depths)
            d = n == 0 ? 0.7 : random.uniform() < 0.5 ? 0 : 3 * random.uniform();
        depths[3] += 0.01;
        if (n == 0) depths[3] = 0.7;
        const CoarserVoxel v = coarserVoxel(depths, kEven.data(), 1);
        const double whole[8] = {v.density, v.density, v.density, v.density,
                                 v.density, v.density, v.density, v.density};
        // Along a beam into the face across `eye`, against it or not, light along `light`:
        // midpoints of kCuts^3 cells a voxel.
        constexpr int kCuts = 48;
        const auto scattered = [&](const double* density, int eye, bool eye_up, int light,
                                   bool light_up) {
            double sum = 0;
            for (int k = 0; k < 8; ++k)
                for (int i = 0; i < kCuts; ++i)
                    for (int j = 0; j < kCuts; ++j) {
                        const double in_eye = (i + 0.5) / kCuts,
                                     in_light = eye == light ? in_eye : (j + 0.5) / kCuts;
                        const auto depthTo = [&](int axis, bool up,
                                                 double at) { // to the face that the beam enters by
                            const int along = 4 >> axis;
                            const bool before = up ? !(k & along) : (k & along);
                            return density[k] * (up ? 1 - at : at)
                                + (before ? density[k ^ along] : 0);
                        };
                        sum += density[k]
                            * std::exp(-depthTo(eye, eye_up, in_eye)
                                       - depthTo(light, light_up, in_light));
                    }
            return sum / (4 * kCuts * kCuts);
        };
        double parts[3] = {0, 0, 0}, even[3] = {0, 0, 0};
        for (int eye = 0; eye < 3; ++eye)
            for (int light = 0; light < 3; ++light)
                for (int ends = 0; ends < 4; ++ends) {
                    const int from = eye != light ? 1 : (ends & 1) == ends >> 1 ? 0 : 2;
                    parts[from] += scattered(depths, eye, ends & 1, light, ends >> 1);
                    even[from] += scattered(whole, eye, ends & 1, light, ends >> 1);
                }
        for (int from = 0; from < 3; ++from)
            EXPECT_NEAR(v.scatter_ratio[from] * even[from], parts[from], 1e-3 * even[from])
                << n << " " << from;
        for (const float scatter_ratio : v.scatter_ratio)
            EXPECT_TRUE(n > 0 || std::abs(scatter_ratio - 1) < 1e-6) << scatter_ratio;
    }
}

TEST(VoxelTree, AHomogeneousBlockIsExactAtEveryLevel)
{
    for (const bool tiles : {false, true}) {
        Volume volume = emptyVolume(0.1);
        const openvdb::CoordBBox box(openvdb::Coord(-64), openvdb::Coord(63));
        if (tiles) volume.parts[0].density->sparseFill(box, 0.7f, true);
        else volume.parts[0].density->denseFill(box, 0.7f, true);
        VoxelTree level(volume);
        for (int k = 1; k <= 6; ++k) {
            VoxelTree next = VoxelTree::coarser(level, 3);
            level = std::move(next);
            EXPECT_NEAR(level.voxelSize(), 0.1 * (1 << k), 1e-12);
            EXPECT_EQ(level.voxelCount(), std::uint64_t(128 * 128 * 128) >> (3 * k)) << k << tiles;
            const Vec3d d = Vec3d(0.2, -0.3, 1).unit(), o(0.05, 0.03, -8);
            const MarchRay r(level, level.toCorner(o), d, MarchRay::kFar);
            EXPECT_NEAR(lineIntegral<false>(level, r, d, 1e30) * level.voxelSize(),
                        0.7 * 12.8 / d[2], 1e-5)
                << k << tiles;
        }
    }
}

// Parallel rays through random voxels, level by level: the mean transmittance stays, where that of
// mean densities falls.
TEST(VoxelTree, RandomVolumesKeepTheirMeanTransmittance)
{
    VoxelTree level(noise(64, 0.15, 0.8));
    double first = 0;
    for (int k = 0; k <= 3; ++k) {
        Random random(5);
        double mean = 0;
        const int count = 4000;
        for (int i = 0; i < count; ++i) {
            Vec3d d(0.0);
            d[i % 3] = 1;
            if (i % 2)
                d = (d + 0.4 * Vec3d(random.symmetric(), random.symmetric(), random.symmetric()))
                        .unit();
            const Vec3d p = Vec3d(27, 32, 16)
                + 20.0 * Vec3d(random.symmetric(), random.symmetric(), random.symmetric());
            const MarchRay r(level, level.toCorner(p - 500.0 * d), d, MarchRay::kFar);
            mean += std::exp(-lineIntegral<false>(level, r, d, 1e30) * level.voxelSize()) / count;
        }
        if (k == 0) first = mean;
        EXPECT_NEAR(std::log(mean) / std::log(first), 1, 0.03)
            << "level " << k << ": " << mean << " of " << first;
        level = VoxelTree::coarser(level, 1);
    }
}

// Two directions at an angle 2a in equal parts: spread tan a, and gamma widened by the closed form.
TEST(VoxelTree, CoarserVoxelsWidenTheLobe)
{
    for (const double angle : {0.1, 0.3}) {
        Volume volume = emptyVolume();
        volume.parts[0].direction = openvdb::Vec3SGrid::create(Vec3f(0.0f));
        for (int k = 0; k < 8; ++k) {
            const openvdb::Coord at(k >> 2, k >> 1 & 1, k & 1);
            volume.parts[0].density->tree().setValue(at, 1);
            volume.parts[0].direction->tree().setValue(
                at, Vec3f(float(std::sin(k % 2 ? angle : -angle)), float(std::cos(angle)), 0));
        }
        const VoxelTree tree = VoxelTree::coarser(VoxelTree(volume), 1);
        ASSERT_EQ(tree.voxelCount(), 1u);
        VoxelContent content;
        tree.contents(0, 0, [&](const VoxelContent& c) { content = c; });
        EXPECT_NEAR(content.direction[1], 1, 1e-6);
        const double spread = std::tan(angle) / std::sqrt(2.0); // l2 / l1 = tan^2, l3 = 0
        EXPECT_NEAR(VoxelTree::spreadOf(content.spread_code), spread, 0.5 / 62 + 1e-3);
        Material m;
        const double wide = m.gamma * m.gamma + 8 * std::log(2.0) * spread * spread;
        EXPECT_NEAR(std::log(2.0) / makeLobe(m, spread).falloff, wide, 1e-9);
    }
}

// Far more leaves than are put together at a time, each with a voxel of both parts.
TEST(VoxelTree, CoarserVoxelsKeepTheirPartsInEveryLeaf)
{
    Volume volume;
    for (const char* name : {"a", "b"}) {
        volume.parts.push_back(emptyPart());
        volume.parts.back().material = name;
    }
    const auto density = [](int x, int y, int z, int part) {
        return float(1 + x + 2 * y + 4 * z) / float(part + 1);
    };
    constexpr int kEdge = 20;
    for (int x = 0; x < kEdge; ++x)
        for (int y = 0; y < kEdge; ++y)
            for (int z = 0; z < kEdge; ++z)
                for (int part = 0; part < 2; ++part)
                    volume.parts[part].density->tree().setValue({16 * x, 16 * y, 16 * z},
                                                                density(x, y, z, part));
    const VoxelTree tree = VoxelTree::coarser(VoxelTree(volume), 0); // keeps the mean
    ASSERT_EQ(tree.leafCount(), std::size_t(kEdge * kEdge * kEdge));
    for (int x = 0; x < kEdge; ++x)
        for (int y = 0; y < kEdge; ++y)
            for (int z = 0; z < kEdge; ++z) {
                double found[2] = {0, 0};
                tree.contents(tree.leafAt(8 * x, 8 * y, 8 * z), 0,
                              [&](const VoxelContent& c) { found[c.part] += c.density; });
                for (int part = 0; part < 2; ++part)
                    ASSERT_NEAR(found[part], density(x, y, z, part) / 8, 1e-5 * found[part]);
            }
}

// Levels change on the way without gaps: a homogeneous block that reaches through several shows the
// closed form.
TEST(LevelOfDetail, LevelsMeetWithoutGapsOrOverlap)
{
    Volume volume = emptyVolume(0.01);
    volume.parts[0].density->denseFill(openvdb::CoordBBox({0, 0, 0}, {31, 31, 511}), 0.5f, true);
    Camera camera;
    camera.eye = {0.16, 0.16, -0.5};
    camera.target = {0.16, 0.16, 1};
    camera.field_of_view = 0.02;
    RenderParams params;
    params.width = params.height = 2;
    params.cutoff = 0;
    params.lod = true;
    for (const Filter filter : {Filter::box, Filter::trilinear})
        for (const Shadows shadows : {Shadows::exact, Shadows::sweep}) {
            params.filter = filter;
            params.shadows = shadows;
            Light light;
            light.direction = {0, 0, 1};
            const CameraRays rays(camera, params.width, params.height);
            Material material;
            material.alpha = 1;
            const std::vector<VoxelLevel> in_use =
                voxelLevels(std::make_shared<const VoxelTree>(volume), camera, params);
            EXPECT_GE(in_use.size(), 2u);
            const LevelOfDetail levels(in_use, {material}, {light}, params, rays, {0, 0, 2, 2});
            Integrator::Scratch scratch;
            const CameraRay ray = rays.ray(0.9, 1.2);
            const RaySample sample = levels.trace(ray.origin, ray.direction, scratch);
            EXPECT_NEAR(-std::log(sample.transmittance), 0.5 * 5.12,
                        filter == Filter::box ? 2e-3 : 0.01)
                << int(filter) << int(shadows);
            EXPECT_NEAR(sample.radiance[0], 0.25 * -std::expm1(-2 * 0.5 * 5.12) / 2, 3e-3)
                << int(filter) << int(shadows);
        }
}

// From afar one sample with levels of detail is nearer to many full samples than four full ones
// are.
TEST(LevelOfDetail, InSparseNoiseOneSampleIsWorthMoreThanFourWithout)
{
    const VoxelTree tree(noise(64, 0.05, 1));
    Light light;
    light.direction = Vec3d(1, -1, -1).unit();
    const Image reference = fromAfar(tree, light, 256, false),
                four = fromAfar(tree, light, 4, false), one = fromAfar(tree, light, 1, true);
    double error_four = 0, error_one = 0;
    for (int y = 4; y < 10; ++y)
        for (int x = 4; x < 10; ++x) { // inside the outline
            error_four += std::pow(four.pixel(x, y)[0] - reference.pixel(x, y)[0], 2);
            error_one += std::pow(one.pixel(x, y)[0] - reference.pixel(x, y)[0], 2);
        }
    EXPECT_LT(error_one, error_four);
}

// Clumps shade what lies in them. Wide voxels of the same mean transmittance alone are 1.6 times
// too bright here; with what their parts show they are 4 % too dark under light from the eye's
// side, and 26 % under light that grazes (the limit says no more than that).
TEST(LevelOfDetail, ClumpsAreAsBrightFromAfar)
{
    const VoxelTree tree(noise(64, 0.1, 6));
    const auto mean = [&](const Light& light, int samples, bool lod) {
        const Image image = fromAfar(tree, light, samples, lod);
        double sum = 0;
        for (int y = 4; y < 10; ++y)
            for (int x = 4; x < 10; ++x) sum += image.pixel(x, y)[0];
        return sum;
    };
    for (const Vec3d& direction : {Vec3d(0.3, -0.2, -1), Vec3d(1, -1, -0.5)}) {
        Light light;
        light.direction = direction.unit();
        const double full = mean(light, 64, false), lod = mean(light, 16, true);
        EXPECT_NEAR(lod / full, 1, 0.3) << direction;
    }
}
