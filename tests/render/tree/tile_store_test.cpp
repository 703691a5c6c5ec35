// SPDX-License-Identifier: Apache-2.0
// Trees whose tiles are made when rays ask for them, against trees that are complete.
#include "volcomp/render/tree/tile_store.h"

#include <algorithm>
#include <cmath>
#include <thread>

#include <gtest/gtest.h>

#include "volcomp/base/error.h"
#include "volcomp/base/random.h"
#include "volcomp/render/picture_tracer.h"
#include "volcomp/render/render.h"
#include "volcomp/render/tree/voxel_levels.h"
#include "volcomp/render/tree/voxel_tree.h"
#include "tests/support/message_of.h"
#include "tests/support/volume_tiles.h"
#include "tests/support/volumes.h"

namespace volcomp {
namespace {

using openvdb::Coord;

const bool kStarted = (openvdb::initialize(), true);

std::shared_ptr<TileBudget> gigabyte()
{
    return std::make_shared<TileBudget>(std::size_t(1) << 30);
}

/// Two parts that meet, in several nodes and at negative coordinates.
Volume twoParts()
{
    Volume volume;
    Random random(5);
    for (const char* material : {"bark", "fur"}) {
        VolumePart& part = volume.parts.emplace_back(emptyPart(0.25));
        part.material = material;
        part.kind = part.material == "fur" ? MaterialKind::fibre : MaterialKind::surface;
        part.direction = openvdb::Vec3SGrid::create(Vec3f(0.0f));
        part.direction->setTransform(part.density->transformPtr());
        for (int i = 0; i < 6000; ++i) {
            const auto at = [&] { return int(random.uniform() * 200) - 60; };
            const Coord c(at(), at() / 8, at());
            part.density->tree().setValue(c, float(1 + int(64 * random.uniform())) / 16);
            part.direction->tree().setValue(c, {0.6f, float(random.uniform()) * 0.7f, 0.3f});
        }
    }
    return volume;
}

void expectSameVoxels(const VoxelTree& tree, const VoxelTree& expected)
{
    std::size_t places = 0, others = 0;
    expected.forEachCell([&](const Coord& origin, int other) {
        bool any = false;
        for (int n = 0; n < kLeafSize; ++n) any |= expected.densities(other)[n] > 0;
        others += any;
        const int leaf = tree.leafAt(origin[0], origin[1], origin[2]);
        ASSERT_EQ(leaf != VoxelTree::kEmpty, any);
        for (int n = 0; any && n < kLeafSize; ++n) {
            ASSERT_EQ(tree.densities(leaf)[n], expected.densities(other)[n]);
            if (!(tree.densities(leaf)[n] > 0)) continue;
            std::vector<VoxelContent> a, b;
            tree.contents(leaf, n, [&](const VoxelContent& c) { a.push_back(c); });
            expected.contents(other, n, [&](const VoxelContent& c) { b.push_back(c); });
            ASSERT_EQ(a.size(), b.size());
            for (std::size_t i = 0; i < a.size(); ++i) {
                ASSERT_EQ(a[i].part, b[i].part);
                ASSERT_EQ(a[i].density, b[i].density);
                ASSERT_EQ(a[i].direction, b[i].direction);
                ASSERT_EQ(a[i].colour, b[i].colour);
            }
        }
    });
    tree.forEachCell([&](const Coord&, int) { ++places; });
    EXPECT_EQ(places, others);
    EXPECT_EQ(tree.voxelCount(), expected.voxelCount());
}

Camera cameraFor(double distance)
{
    Camera camera;
    camera.eye = {10, 12, distance};
    camera.target = {10, 0, 10};
    camera.field_of_view = 0.9;
    return camera;
}

std::vector<Material> materials()
{
    std::vector<Material> all(2);
    all[0].name = "bark";
    all[0].kind = MaterialKind::surface;
    all[1].name = "fur";
    all[1].kind = MaterialKind::fibre;
    return all;
}

RenderParams smallPicture(Shadows shadows)
{
    RenderParams params;
    params.width = 60;
    params.height = 44;
    params.samples = 2;
    params.lod = false;
    params.shadows = shadows;
    return params;
}

std::vector<Light> twoLights()
{
    Light sun;
    sun.kind = LightKind::directional;
    sun.direction = Vec3d(0.4, -1, 0.3).unit();
    sun.strength = Vec3d(1);
    Light lamp;
    lamp.kind = LightKind::point;
    lamp.position = {30, 9, -20};
    lamp.strength = Vec3d(300);
    return {sun, lamp};
}

} // namespace

TEST(TileStore, HoldsWhatTheVolumeHolds)
{
    const Volume volume = twoParts();
    const VoxelTree expected(volume);
    const auto maker = std::make_shared<VolumeTiles>(volume);
    const VoxelTree tree(maker, gigabyte());
    EXPECT_EQ(tree.bounds(), expected.bounds());
    EXPECT_EQ(tree.leafCount(), 0u);
    expectSameVoxels(tree, expected);
    EXPECT_EQ(tree.leafAt(100000, 3, 4), VoxelTree::kEmpty);
    EXPECT_EQ(std::size_t(maker->made), tree.tiles()->tileCount());
}

TEST(TileStore, ManyThreadsMakeEachTileOnce)
{
    const Volume volume = twoParts();
    const VoxelTree expected(volume);
    for (int run = 0; run < 4; ++run) {
        const auto maker = std::make_shared<VolumeTiles>(volume);
        const VoxelTree tree(maker, gigabyte());
        std::vector<std::thread> threads;
        std::atomic<int> wrong{0};
        for (int t = 0; t < 16; ++t)
            threads.emplace_back([&, t] {
                Random random(std::uint64_t(100 * run + t));
                for (int i = 0; i < 4000; ++i) {
                    const auto at = [&] { return int(random.uniform() * 260) - 90; };
                    const int x = at(), y = at() / 8, z = at();
                    wrong += tree.density(x, y, z) != expected.density(x, y, z);
                }
            });
        for (std::thread& thread : threads) thread.join();
        EXPECT_EQ(wrong, 0);
        EXPECT_EQ(std::size_t(maker->made), tree.tiles()->tileCount());
        tree.tiles()->make(tree.bounds());
        EXPECT_EQ(std::size_t(maker->made), tree.tiles()->tileCount());
        expectSameVoxels(tree, expected);
    }
}

TEST(TileStore, MakesABoxAndNothingElse)
{
    const auto maker = std::make_shared<VolumeTiles>(twoParts());
    const VoxelTree tree(maker, gigabyte());
    const openvdb::CoordBBox box(Coord(-20, -8, 3), Coord(40, 7, 60));
    tree.tiles()->make(box);
    EXPECT_GT(tree.leafCount(), 0u);
    tree.forEachCell([&](const Coord& origin, int) {
        const Coord tile = origin & ~(kTileDim - 1);
        EXPECT_TRUE(box.hasOverlap({tile, tile.offsetBy(kTileDim - 1)}));
    });
}

TEST(TileStore, SaysThatTheBudgetIsSpent)
{
    const auto budget = std::make_shared<TileBudget>(60000);
    {
        const VoxelTree tree(std::make_shared<VolumeTiles>(twoParts()), budget);
        EXPECT_NE(messageOf([&] { tree.tiles()->make(tree.bounds()); }).find("--max-memory"),
                  std::string::npos);
        EXPECT_GT(budget->used(), 0u);
    }
    EXPECT_EQ(budget->used(), 0u);
}

TEST(TileStore, ShowsThePictureOfTheCompleteTree)
{
    const Volume volume = twoParts();
    const auto complete = std::make_shared<const VoxelTree>(volume);
    for (const Shadows shadows : {Shadows::none, Shadows::exact, Shadows::sweep})
        for (const double distance : {50.0, 12.0}) { // outside, and inside
            const RenderParams params = smallPicture(shadows);
            const Camera camera = cameraFor(distance);
            const auto maker = std::make_shared<VolumeTiles>(volume);
            VoxelLevel level;
            level.tree = std::make_shared<const VoxelTree>(maker, gigabyte());
            const Image expected = render({VoxelLevel{complete}}, materials(), camera, twoLights(),
                                          params),
                        image = render({level}, materials(), camera, twoLights(), params);
            ASSERT_EQ(image.pixels.size(), expected.pixels.size());
            EXPECT_EQ(image.pixels, expected.pixels) << int(shadows) << " " << distance;
        }
}

// Light is the whole picture's, so it is the same in a crop of it.
TEST(TileStore, ACropShowsThePixelsOfTheWhole)
{
    const Volume volume = twoParts();
    for (const bool complete : {false, true}) {
        RenderParams params = smallPicture(Shadows::sweep);
        const auto picture = [&] {
            VoxelLevel level;
            level.tree = complete ? std::make_shared<const VoxelTree>(volume)
                                  : std::make_shared<const VoxelTree>(
                                      std::make_shared<VolumeTiles>(volume), gigabyte());
            return render({level}, materials(), cameraFor(50), twoLights(), params);
        };
        const Image whole = picture();
        params.crop = {23, 17, 11, 9};
        const Image crop = picture();
        for (int y = 0; y < crop.height; ++y)
            for (int x = 0; x < crop.width; ++x)
                for (std::size_t c = 0; c < crop.channels.size(); ++c)
                    EXPECT_EQ(crop.pixel(x, y)[c], whole.pixel(x + 23, y + 17)[c]) << x << " " << y;
    }
}

TEST(TileStore, ShowsTheSamePictureWithLittleMemory)
{
    const Volume volume = twoParts();
    for (const Shadows shadows : {Shadows::exact, Shadows::sweep}) {
        const RenderParams params = smallPicture(shadows);
        Light sun = twoLights()[0]; // along the volume: one layer of nodes after another
        sun.direction = Vec3d(0.2, -0.5, 1).unit();
        const auto picture = [&](const std::shared_ptr<TileBudget>& budget) {
            VoxelLevel level;
            level.tree =
                std::make_shared<const VoxelTree>(std::make_shared<VolumeTiles>(volume), budget);
            return render({level}, materials(), cameraFor(50), {sun}, params).pixels;
        };
        const auto all = gigabyte();
        const std::vector<float> expected = picture(all);
        EXPECT_EQ(all->drops(), 0u);
        const auto little = std::make_shared<TileBudget>(all->peak() * 19 / 20);
        EXPECT_EQ(picture(little), expected);
        EXPECT_GT(little->drops(), 0u);
        EXPECT_LT(little->peak(), little->most());
    }
}

// Near by, light comes through the level's own voxels: those of another volume, four times as wide,
// change nothing.
TEST(TileStore, LightFromNearByComesThroughTheLevelItself)
{
    const Volume volume = twoParts();
    Volume other;
    for (const VolumePart& part : volume.parts) {
        other.parts.push_back(emptyPart(1));
        other.parts.back().kind = part.kind;
        other.parts.back().material = part.material;
        other.parts.back().density->denseFill({Coord(-20), Coord(60)}, 5.0f, true);
    }
    const auto picture = [&](bool has_around) {
        VoxelLevel level;
        const auto budget = gigabyte();
        level.tree =
            std::make_shared<const VoxelTree>(std::make_shared<VolumeTiles>(volume), budget);
        if (has_around)
            level.around =
                std::make_shared<const VoxelTree>(std::make_shared<VolumeTiles>(other), budget);
        RenderParams params = smallPicture(Shadows::sweep);
        params.samples = 1; // levels meet at their distances
        return render({level}, materials(), cameraFor(50), {twoLights()[0]}, params).pixels;
    };
    EXPECT_EQ(picture(true), picture(false));
}

// A slab of fog far above the ground, which light passes in voxels four times as wide.
TEST(TileStore, LightFromAfarComesThroughCoarserVoxels)
{
    constexpr double kFog = 0.05, kThick = 16; // 1 / m, m
    const auto maker = [](double voxel, bool fog) {
        Volume volume;
        volume.parts.push_back(emptyPart(voxel));
        const auto fill = [&](double low, double high, double half, double density) {
            const auto at = [&](double x) { return int(std::lround(x / voxel)); };
            volume.parts[0].density->denseFill(
                {Coord(at(-half), at(low), at(-half)), Coord(at(half), at(high) - 1, at(half))},
                float(density), true);
        };
        fill(0, 2, 6, 2.0);
        if (fog) fill(80, 80 + kThick, 16, kFog); // behind the node next to the ground's
        return std::make_shared<VolumeTiles>(volume);
    };
    Light sun;
    sun.kind = LightKind::directional;
    sun.direction = {0, -1, 0};
    sun.strength = Vec3d(1);
    Camera camera;
    camera.eye = {0, 20, 20};
    camera.target = {0, 1, 0};
    camera.field_of_view = 0.3;
    const auto shown = [&](bool fog, std::size_t& tiles) {
        VoxelLevel level;
        const auto budget = gigabyte();
        level.tree = std::make_shared<const VoxelTree>(maker(0.25, fog), budget);
        level.around = std::make_shared<const VoxelTree>(maker(1, fog), budget);
        const Image image =
            render({level}, materials(), camera, {sun}, smallPicture(Shadows::sweep));
        tiles = level.tree->tiles()->tileCount();
        return double(image.pixel(30, 22)[0]);
    };
    std::size_t without = 0, with = 0;
    const double bright = shown(false, without), shaded = shown(true, with);
    EXPECT_GT(bright, 0);
    EXPECT_NEAR(shaded / bright, std::exp(-kFog * kThick), 0.01 * std::exp(-kFog * kThick));
    EXPECT_EQ(with, without); // nothing of the fog is made of fine voxels
}

TEST(TileStore, LevelsMeetInTheirDistances)
{
    RenderParams params = smallPicture(Shadows::none);
    params.width = 1000;
    Camera camera = cameraFor(50);
    camera.field_of_view = 2 * std::atan(0.5); // a pixel is 1/1000 wide at distance 1
    std::vector<std::shared_ptr<const TileMaker>> makers;
    for (const double voxel : {0.5, 1.0, 2.0}) {
        Volume volume;
        volume.parts.push_back(emptyPart(voxel));
        volume.parts[0].density->tree().setValue(Coord(0), 1.0f);
        makers.push_back(std::make_shared<VolumeTiles>(volume));
    }
    const auto levels = tileLevels(tileTrees(makers, gigabyte()), camera, params, 2);
    ASSERT_EQ(levels.size(), 3u);
    EXPECT_EQ(levels[0].start, 0);
    EXPECT_NEAR(levels[0].end, 500, 1e-9); // a voxel of 1 is two pixels there
    EXPECT_EQ(levels[1].start, levels[0].end);
    EXPECT_NEAR(levels[1].end, 1000, 1e-9);
    EXPECT_EQ(levels[2].end, kInfinity);
    EXPECT_EQ(levels[0].around, levels[2].tree);
    EXPECT_EQ(levelsNeeded(0.5, 499, camera, params, 2), 1);
    EXPECT_EQ(levelsNeeded(0.5, 501, camera, params, 2), 2);
    EXPECT_EQ(levelsNeeded(0.5, 10000, camera, params, 2), 6);
}

// However a ray is cut into levels, it meets all of a homogeneous fog, and all of it once.
TEST(TileStore, LevelsNeitherMissNorRepeat)
{
    constexpr double kEdge = 64, kDensity = 0.03;
    std::vector<std::shared_ptr<const TileMaker>> makers;
    for (const double voxel : {0.5, 1.0, 2.0, 4.0}) {
        Volume volume;
        volume.parts.push_back(emptyPart(voxel));
        volume.parts[0].density->setTransform(
            openvdb::math::Transform::createLinearTransform(voxel));
        volume.parts[0].density->transform().postTranslate(Vec3d(0.5 * voxel));
        const int last = int(kEdge / voxel) - 1;
        volume.parts[0].density->denseFill({Coord(0), Coord(last)}, float(kDensity), true);
        makers.push_back(std::make_shared<VolumeTiles>(volume));
    }
    RenderParams params = smallPicture(Shadows::none);
    params.width = 100;
    params.tau = 0.7;
    params.cutoff = 0;
    Random random(3);
    for (const Vec3d& eye : {Vec3d(-20, 30, 31), Vec3d(20, 30, 31)}) { // outside, and inside
        Camera camera;
        camera.eye = eye;
        camera.target = {32, 33, 34};
        camera.field_of_view = 2 * std::atan(0.5);
        const PictureTracer tracer(tileLevels(tileTrees(makers, gigabyte()), camera, params, 2),
                                   materials(), camera, {}, params);
        Integrator::Scratch scratch;
        for (int i = 0; i < 1000; ++i) {
            CameraRay ray = tracer.ray(100 * random.uniform(), 44 * random.uniform());
            if (i % 10 == 0) ray.direction = i % 20 ? Vec3d(1, 0, 0) : Vec3d(1, 1e-4, 0).unit();
            double start = 0, end = kInfinity;
            for (int a = 0; a < 3; ++a) {
                const double d = ray.direction[a], o = ray.origin[a];
                if (d == 0) continue;
                start = std::max(start, std::min(-o / d, (kEdge - o) / d));
                end = std::min(end, std::max(-o / d, (kEdge - o) / d));
            }
            const double expected = std::exp(-params.tau * kDensity * std::max(0.0, end - start));
            for (const double shift : {0.75, 1.0, 1.3})
                EXPECT_NEAR(tracer.trace(ray, scratch, nullptr, 0, shift).transmittance, expected,
                            1e-6);
        }
    }
}

TEST(LevelShift, ASamplesStepsFillAnOctaveEvenly)
{
    EXPECT_EQ(levelShift(3, 4, 0, 1), 1);
    for (const int samples : {2, 4, 9}) {
        std::vector<double> logs;
        for (int s = 0; s < samples; ++s) logs.push_back(std::log2(levelShift(7, 11, s, samples)));
        std::sort(logs.begin(), logs.end());
        for (int s = 0; s < samples; ++s)
            EXPECT_NEAR(logs[std::size_t(s)], (s + 0.5) / samples - 0.5, 1e-12);
    }
    double mean = 0; // of the first sample, over pixels
    for (int x = 0; x < 100; ++x)
        for (int y = 0; y < 100; ++y) mean += std::log2(levelShift(x, y, 0, 4)) / 1e4;
    EXPECT_NEAR(mean, 0, 0.01);
}

} // namespace volcomp
