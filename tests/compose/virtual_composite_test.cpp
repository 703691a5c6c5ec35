// SPDX-License-Identifier: Apache-2.0
#include "volcomp/compose/virtual_composite.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>
#include <thread>

#include <gtest/gtest.h>

#include "tests/support/boxes.h"
#include "tests/support/grounds.h"
#include "tests/support/message_of.h"
#include "tests/support/sanitizer.h"
#include "volcomp/compose/compose.h"
#include "volcomp/volume/block_source.h"

namespace volcomp {
namespace {

using openvdb::Coord;

/// Some voxels of a part, at random in a box of so many voxels.
void scatterVoxels(VolumePart& part, Random& r, const Coord& size, int count)
{
    for (int k = 0; k < count; ++k) {
        const Coord c(int(r.uniform(-0.5, 0.5) * size[0]), int(r.uniform() * size[1]),
                      int(r.uniform(-0.5, 0.5) * size[2]));
        part.density->tree().setValue(c, float(r.uniform(5, 80)));
        if (part.direction)
            part.direction->tree().setValue(
                c, Vec3f(Vec3d(r.normal(), r.normal(), r.normal()).unit() * r.uniform(0.3, 1)));
        if (part.colour)
            part.colour->tree().setValue(
                c, Vec3f(float(r.uniform()), float(r.uniform()), float(r.uniform())));
        if (part.own_share) part.own_share->tree().setValue(c, float(r.uniform()));
    }
}

VolumePart fullestPart(double voxel, const std::string& material)
{
    VolumePart part = fullPart(voxel, material);
    part.own_share = openvdb::FloatGrid::create(0.0f);
    part.own_share->setTransform(part.density->transformPtr());
    return part;
}

/// Boxes of fibres, leaves and both, some 0.24 m high: with all values, and with few.
std::vector<Box> someBoxes(double voxel, std::uint64_t seed)
{
    Random r(seed);
    const auto size = [&](double x, double y) {
        return Coord(int(x / voxel), int(y / voxel), int(x / voxel));
    };
    Box tuft{"tuft", 0, {}}, plant{"plant", 0, {}}, plain{"plain", 0, {}}, none{"none", 0, {}};
    tuft.volume.parts.push_back(fullestPart(voxel, "fur"));
    scatterVoxels(tuft.volume.parts[0], r, size(0.1, 0.24), 250);
    plant.volume.parts.push_back(fullestPart(voxel, "bark"));
    plant.volume.parts.push_back(fullestPart(voxel, "leaf"));
    plant.volume.parts[0].colour = nullptr;
    plant.volume.parts[1].kind = MaterialKind::surface;
    scatterVoxels(plant.volume.parts[0], r, size(0.05, 0.2), 60);
    scatterVoxels(plant.volume.parts[1], r, size(0.2, 0.24), 200);
    plain.volume.parts.push_back(emptyPart(voxel));
    plain.volume.parts[0].material = "fur";
    plain.volume.parts[0].uniform_colour = Vec3f(0.5f, 0.25f, 0.125f);
    scatterVoxels(plain.volume.parts[0], r, size(0.15, 0.1), 100);
    none.volume.parts.push_back(fullestPart(voxel, "leaf"));
    none.volume.parts[0].kind = MaterialKind::surface;
    return {tuft, plant, plain, none};
}

/// An image whose pixels have colours of their own.
MapFactor patches()
{
    const std::filesystem::path file = std::filesystem::path(testing::TempDir())
        / (std::string("virtual_") + testing::UnitTest::GetInstance()->current_test_info()->name()
           + ".pfm");
    std::ofstream stream(file, std::ios::binary);
    stream << "PF\n16 16\n-1.0\n";
    Random r(5);
    for (int k = 0; k < 16 * 16; ++k) {
        const float pixel[3] = {float(r.uniform()), float(r.uniform()), float(r.uniform())};
        stream.write(reinterpret_cast<const char*>(pixel), sizeof pixel);
    }
    MapFactor map;
    map.image = file;
    map.wrap = Wrap::clamp;
    return map;
}

/// Placements whose boxes are 0.3 to 300 voxels of 0.01 m high, within `reach` of the origin along
/// each axis. Those of layer 1 have voxel tints on a ground.
PlacedScene someScene(int count, double reach, std::uint64_t seed)
{
    PlacedScene scene;
    MapProjection plane;
    plane.kind = ProjectionKind::plane;
    plane.up = Vec3d(0, 0, -1);
    plane.width = plane.height = 2 * reach;
    TerrainSpec spec;
    spec.width = spec.depth = reach;
    Mesh mesh = makeTerrain(spec);
    prepareMesh(mesh, 1, Vec3d(0.0), Orientation::outward);
    scene.surfaces.push_back(
        {"ground", Surface(std::move(mesh), plane), SkinSpec(), SecondDensity()});
    scene.layers.push_back({Layer(), 0, SecondDensity(), false, 1});
    scene.layers.push_back({Layer(), 0, SecondDensity({patches()}, true), true, 1});
    Random r(seed);
    for (int k = 0; k < count; ++k) {
        const double scale = std::exp(r.uniform(std::log(0.0125), std::log(12.5)));
        Placement p = randomPlacement(hashKey(seed, std::uint64_t(k)), reach, scale, scale);
        p.box = std::uint16_t(r.uniform(0, 4));
        p.layer = std::uint16_t(r.uniform(0, 2));
        scene.boxes.placements.push_back(p);
    }
    return scene;
}

void expectSame(const BlockVoxels& made, const BlockVoxels& expected, const Coord& at)
{
    ASSERT_EQ(made.size(), expected.size());
    for (std::size_t p = 0; p < made.size(); ++p) {
        const PartVoxels &a = made[p], &b = expected[p];
        ASSERT_EQ(a.mask, b.mask) << at;
        ASSERT_EQ(a.density, b.density) << at;
        ASSERT_EQ(a.direction, b.direction) << at;
        ASSERT_EQ(a.colour, b.colour) << at;
        ASSERT_EQ(a.scatter_ratio, b.scatter_ratio) << at;
        ASSERT_EQ(a.own_share, b.own_share) << at;
    }
}

void expectSameParts(const std::vector<PartInfo>& a, const std::vector<PartInfo>& b)
{
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t p = 0; p < a.size(); ++p) {
        EXPECT_EQ(a[p].material, b[p].material);
        EXPECT_EQ(a[p].kind, b[p].kind);
        EXPECT_EQ(a[p].grid, b[p].grid);
        EXPECT_EQ(a[p].has_direction, b[p].has_direction);
        EXPECT_EQ(a[p].has_colour, b[p].has_colour);
        EXPECT_EQ(a[p].has_scatter_ratio, b[p].has_scatter_ratio);
        EXPECT_EQ(a[p].uniform_colour, b[p].uniform_colour);
    }
}

/// The first voxels of all nodes that a level may have.
std::vector<Coord> nodesOf(const TileMaker& level)
{
    std::vector<Coord> nodes;
    if (level.bounds().empty()) return nodes;
    const Coord low = level.bounds().min() & ~(kNodeDim - 1), high = level.bounds().max();
    for (int x = low[0]; x <= high[0]; x += kNodeDim)
        for (int y = low[1]; y <= high[1]; y += kNodeDim)
            for (int z = low[2]; z <= high[2]; z += kNodeDim) nodes.emplace_back(x, y, z);
    return nodes;
}

Coord tileOf(const Coord& node, int number)
{
    return node.offsetBy((number >> 6) * kTileDim, (number >> 3 & 7) * kTileDim,
                         (number & 7) * kTileDim);
}

Coord leafOf(const Coord& tile, int number)
{
    return tile.offsetBy((number >> 2) * kLeafDim, (number >> 1 & 1) * kLeafDim,
                         (number & 1) * kLeafDim);
}

/// Compares every voxel of a level with what compose() makes of the whole scene. Returns how many
/// leaves have particles.
std::size_t compare(const TileMaker& level, const PackedVolume& volume)
{
    const PackedSource whole(volume);
    expectSameParts(level.parts(), whole.parts());
    EXPECT_EQ(level.transform(), whole.transform());
    std::set<Coord> left; // blocks of the whole that no tile has held yet
    for (const Coord& node : whole.nodes()) {
        const NodeBlocks blocks = whole.blocks(node);
        for (int n = 0; n < kNodeSize; ++n)
            if (blocks.voxels[std::size_t(n)]) left.insert(node + leafInNode(n));
    }
    const std::size_t count = left.size();
    for (const Coord& leaf : left) {
        EXPECT_TRUE(level.bounds().isInside(leaf)) << leaf;
        EXPECT_TRUE(level.bounds().isInside(leaf.offsetBy(kLeafDim - 1))) << leaf;
    }
    TileVoxels voxels;
    BlockVoxels expected;
    for (const Coord& node : nodesOf(level)) {
        const std::bitset<kTilesOfNode> tiles = level.tiles(node);
        for (int t = 0; t < kTilesOfNode; ++t) {
            const Coord tile = tileOf(node, t);
            if (!tiles[std::size_t(t)] && (t + node[0] / kNodeDim) % 16 != 0) continue;
            level.make(tile, voxels); // also some that are empty
            for (int l = 0; l < 8; ++l) {
                const Coord leaf = leafOf(tile, l);
                whole.take(leaf, expected);
                expectSame(voxels[std::size_t(l)], expected, leaf);
                if (testing::Test::HasFatalFailure()) return count;
                if (tiles[std::size_t(t)]) left.erase(leaf);
            }
        }
    }
    EXPECT_TRUE(left.empty()) << left.size() << " of " << count << " blocks are in no tile";
    return count;
}

ComposeParams paramsOf(Kept keep, double minimum_density = 0)
{
    ComposeParams params;
    params.keep = keep;
    params.minimum_density = minimum_density;
    return params;
}

TEST(VirtualComposite, EachLevelHoldsWhatComposingItsVoxelGives)
{
    constexpr double kFinest = 0.01;
    constexpr int kLevels = 7;
    for (const std::uint64_t seed : {1, 2, 3}) {
        if (kSanitized && seed == 3) continue; // they take long
        const std::vector<Box> boxes = someBoxes(seed == 1 ? 0.011 : 0.004, seed);
        const PlacedScene scene = someScene(100, 2.2, seed);
        ComposeParams params =
            paramsOf(seed == 2 ? Kept::integral : Kept::blocked_light, seed == 2 ? 1e-3 : 0);
        const VirtualComposite composite(boxes, scene, params, kFinest, kLevels);
        ASSERT_EQ(composite.levels(), kLevels);
        for (int n = 0; n < kLevels; ++n) {
            params.voxel = kFinest * (1 << n);
            EXPECT_EQ(composite.voxel(n), params.voxel);
            const PackedVolume volume = compose(boxes, scene, params);
            EXPECT_GT(compare(composite.level(n), volume), 4u) << n;
            if (HasFatalFailure()) return;
        }
    }
}

TEST(VirtualComposite, FactorsFollowFromTheScalesAtEachLevel)
{
    // Scales of a narrow range, for which a level of a box is used at two voxel sizes, with other
    // factors at each.
    const std::vector<Box> boxes = someBoxes(0.004, 3);
    PlacedScene scene = placedBoxes({});
    for (int k = 0; k < 40; ++k) {
        Placement p = randomPlacement(hashKey(9, std::uint64_t(k)), 0.5, 0.7, 1.1);
        p.box = std::uint16_t(k % 3);
        scene.boxes.placements.push_back(p);
    }
    ComposeParams params = paramsOf(Kept::blocked_light);
    const VirtualComposite composite(boxes, scene, params, 0.003, 5);
    for (int n = 0; n < 5; ++n) {
        params.voxel = 0.003 * (1 << n);
        compare(composite.level(n), compose(boxes, scene, params));
        if (HasFatalFailure()) return;
    }
}

TEST(VirtualComposite, StepsOfAHalfAreRoundedInOneWay)
{
    // A box's voxel times its scale is half the finest voxel: at 1/2 and below coarser voxels are
    // placed. The order of the operations decides, and must be one everywhere.
    const double voxel = 0.004, finest = 0.00784000015258789;
    const float scale = 0.98f;
    ASSERT_LE(voxel * scale / finest, 0.5);
    ASSERT_GT(voxel * (scale / finest), 0.5);
    const std::vector<Box> boxes = someBoxes(voxel, 5);
    PlacedScene scene = placedBoxes({});
    for (int k = 0; k < 20; ++k) {
        Placement p = randomPlacement(hashKey(11, std::uint64_t(k)), 0.5);
        p.scale = scale;
        p.box = std::uint16_t(k % 3);
        scene.boxes.placements.push_back(p);
    }
    ComposeParams params = paramsOf(Kept::blocked_light);
    const VirtualComposite composite(boxes, scene, params, finest, 3);
    for (int n = 0; n < 3; ++n) {
        params.voxel = std::ldexp(finest, n);
        EXPECT_GT(compare(composite.level(n), compose(boxes, scene, params)), 4u);
        if (HasFatalFailure()) return;
    }
}

TEST(VirtualComposite, SkinsThatAreVoxelsAreSources)
{
    const std::vector<Box> boxes = someBoxes(0.01, 4);
    PlacedScene scene = someScene(12, 0.6, 4);
    for (int k = 0; k < 3; ++k) {
        TerrainSpec spec;
        spec.width = spec.depth = 1.3 + k;
        Mesh mesh = makeTerrain(spec);
        prepareMesh(mesh, 1, Vec3d(0.1 * k, -0.15 * k, 0), Orientation::outward);
        SkinSpec skin;
        skin.material = k == 1 ? "leaf" : "cloth";
        skin.as = SkinAs::voxels;
        skin.depth = k == 2 ? 3.7 : 0;
        skin.colour = Vec3d(0.5, 0.4, 0.3);
        scene.surfaces.push_back(
            {"skin", Surface(std::move(mesh), MapProjection{}), skin, SecondDensity()});
    }
    ComposeParams params = paramsOf(Kept::blocked_light);
    const VirtualComposite composite(boxes, scene, params, 0.02, 4);
    for (int n = 0; n < 4; ++n) {
        params.voxel = 0.02 * (1 << n);
        compare(composite.level(n), compose(boxes, scene, params));
        if (HasFatalFailure()) return;
    }
}

/// All tiles of all levels that may hold particles.
struct TileOfLevel {
    int level;
    Coord tile;
};
std::vector<TileOfLevel> allTiles(const VirtualComposite& composite)
{
    std::vector<TileOfLevel> all;
    for (int n = 0; n < composite.levels(); ++n)
        for (const Coord& node : nodesOf(composite.level(n))) {
            const std::bitset<kTilesOfNode> tiles = composite.level(n).tiles(node);
            for (int t = 0; t < kTilesOfNode; ++t)
                if (tiles[std::size_t(t)]) all.push_back({n, tileOf(node, t)});
        }
    return all;
}

TEST(VirtualComposite, TilesDoNotDependOnOrderAndThreads)
{
    const std::vector<Box> boxes = someBoxes(0.01, 6);
    const PlacedScene scene = someScene(40, 1, 6);
    const ComposeParams params = paramsOf(Kept::blocked_light);
    const VirtualComposite one(boxes, scene, params, 0.02, 5);
    const std::vector<TileOfLevel> tiles = allTiles(one);
    ASSERT_GT(tiles.size(), 200u);
    std::vector<TileVoxels> expected(tiles.size());
    for (std::size_t t = 0; t < tiles.size(); ++t)
        one.level(tiles[t].level).make(tiles[t].tile, expected[t]);
    for (const std::size_t count : {1, 2, 8}) {
        const VirtualComposite other(boxes, scene, params, 0.02, 5);
        // A stride without common factor visits each once; neighbours race for one node.
        std::vector<std::size_t> order(tiles.size());
        for (std::size_t k = 0; k < order.size(); ++k)
            order[k] = count == 8 ? k : (k * 7919) % order.size();
        ASSERT_NE(tiles.size() % 7919, 0u);
        std::vector<TileVoxels> made(tiles.size());
        std::atomic<std::size_t> next{0};
        std::vector<std::thread> threads;
        threads.reserve(count);
        for (std::size_t i = 0; i < count; ++i)
            threads.emplace_back([&] {
                for (std::size_t k = next++; k < order.size(); k = next++) {
                    const TileOfLevel& t = tiles[order[k]];
                    other.level(t.level).make(t.tile, made[order[k]]);
                }
            });
        for (std::thread& t : threads) t.join();
        for (std::size_t t = 0; t < tiles.size(); ++t)
            for (std::size_t l = 0; l < 8; ++l) {
                expectSame(made[t][l], expected[t][l], tiles[t].tile);
                if (HasFatalFailure()) return;
            }
    }
}

TEST(VirtualComposite, TilesThatAreInABoxsBoundsAloneAreEmpty)
{
    // A strand through the box's diagonal, 300 voxels long, turned anyhow: it lies in a few tiles
    // of the thousands that the bounds have.
    Box box{"diagonal", 0, {}};
    VolumePart part = fullPart(0.01);
    for (int k = 0; k < 300; ++k) set(part, Coord(k, k, k), 20, {0, 1, 0}, Vec3f(1.0f));
    box.volume.parts.push_back(part);
    for (const double scale : {0.4, 1.0, 1.4}) {
        const PlacedScene scene = placedBoxes({randomPlacement(3, 0.2, scale, scale)});
        const VirtualComposite composite({box}, scene, paramsOf(Kept::integral), 0.01, 1);
        const std::vector<TileOfLevel> tiles = allTiles(composite);
        std::size_t filled = 0;
        TileVoxels voxels;
        for (const TileOfLevel& t : tiles) {
            composite.level(0).make(t.tile, voxels);
            filled += std::any_of(voxels.begin(), voxels.end(),
                                  [](const BlockVoxels& b) { return !b[0].density.empty(); });
        }
        EXPECT_GT(filled, 10 * scale);
        EXPECT_LT(double(tiles.size()), 2.0 * double(filled));
    }
}

TEST(VirtualComposite, NodesWithoutSourcesCostNothingAndListsCanBeForgotten)
{
    const std::vector<Box> boxes = someBoxes(0.01, 7);
    const PlacedScene scene = someScene(40, 1, 7);
    VirtualComposite composite(boxes, scene, paramsOf(Kept::blocked_light), 0.02, 1);
    TileMaker& level = composite.level(0);
    const std::size_t before = level.memoryBytes();
    for (int x = 0; x < 100; ++x)
        for (int y = 0; y < 100; ++y) {
            const Coord node((x + 100) * kNodeDim, (y - 50) * kNodeDim, y * kNodeDim);
            EXPECT_TRUE(level.tiles(node).none());
        }
    EXPECT_EQ(level.memoryBytes(), before);
    std::vector<TileVoxels> made;
    const std::vector<TileOfLevel> tiles = allTiles(composite);
    const std::size_t with_lists = level.memoryBytes();
    EXPECT_GT(with_lists, before + 4 * tiles.size());
    EXPECT_GT(composite.memoryBytes(), 10000u);
    for (const TileOfLevel& t : tiles) level.make(t.tile, made.emplace_back());
    EXPECT_EQ(level.memoryBytes(), with_lists);
    level.forget();
    EXPECT_EQ(level.memoryBytes(), before);
    TileVoxels again;
    for (std::size_t t = 0; t < tiles.size(); ++t) {
        level.make(tiles[t].tile, again);
        for (std::size_t l = 0; l < 8; ++l) expectSame(again[l], made[t][l], tiles[t].tile);
        if (HasFatalFailure()) return;
    }
    EXPECT_EQ(level.memoryBytes(), with_lists);
}

TEST(VirtualComposite, OfNothingIsOneEmptyPart)
{
    const PlacedScene scene = placedBoxes({});
    const VirtualComposite composite(std::vector<Box>{}, scene, paramsOf(Kept::blocked_light), 0.1,
                                     3);
    const TileMaker& level = composite.level(2);
    EXPECT_EQ(level.parts().size(), 1u);
    EXPECT_TRUE(level.bounds().empty());
    EXPECT_TRUE(level.tiles(Coord(0, 0, 0)).none());
    TileVoxels voxels;
    level.make(Coord(0, 0, 0), voxels);
    for (const BlockVoxels& block : voxels) {
        ASSERT_EQ(block.size(), 1u);
        EXPECT_TRUE(block[0].density.empty());
    }
}

TEST(VirtualComposite, IsRightFarFromTheOrigin)
{
    // 1e7 voxels from it, across a border of nodes.
    const std::vector<Box> boxes = someBoxes(0.01, 8);
    PlacedScene scene = someScene(15, 0.5, 8);
    const Vec3d far(-1e5, 1e5 + 0.37, 64e3);
    for (Placement& p : scene.boxes.placements) p.position += far;
    ComposeParams params = paramsOf(Kept::blocked_light);
    const VirtualComposite composite(boxes, scene, params, 0.01, 2);
    for (int n = 0; n < 2; ++n) {
        params.voxel = 0.01 * (1 << n);
        EXPECT_GT(compare(composite.level(n), compose(boxes, scene, params)), 50u);
        if (HasFatalFailure()) return;
    }
}

TEST(VirtualComposite, ErrorsAreThoseOfComposing)
{
    const std::vector<Box> boxes = someBoxes(0.01, 9);
    const ComposeParams params = paramsOf(Kept::blocked_light);
    PlacedScene scene = someScene(5, 0.5, 9);
    const auto make = [&](double finest, int levels) {
        VirtualComposite(boxes, scene, params, finest, levels);
    };
    EXPECT_NE(messageOf([&] { make(0, 3); }).find("voxel size > 0"), std::string::npos);
    EXPECT_NE(messageOf([&] { make(0.01, 0); }).find("1 level or more"), std::string::npos);
    EXPECT_NE(messageOf([&] { make(1e-9, 3); }).find("2^27 voxels"), std::string::npos);
    scene.boxes.placements[2].box = 4;
    EXPECT_NE(messageOf([&] { make(0.01, 3); }).find("a box below 4, found 4"), std::string::npos);
}

} // namespace
} // namespace volcomp
