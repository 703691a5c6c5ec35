// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/tree/voxel_tree.h"

#include <cmath>
#include <fstream>

#include <gtest/gtest.h>
#include <openvdb/io/File.h>

#include "volcomp/base/random.h"
#include "volcomp/render/march/march.h"
#include "volcomp/render/shade.h"
#include "volcomp/render/tree/voxel_tree_io.h"
#include "volcomp/volume/vdb_io.h"
#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/volumes.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;
using openvdb::Coord;

const bool kStarted = (openvdb::initialize(), true);

openvdb::Vec3SGrid::Ptr randomVectors(const VolumePart& part, Random& random)
{
    const auto grid = openvdb::Vec3SGrid::create(Vec3f(0.0f));
    grid->setTransform(part.density->transformPtr());
    for (auto v = part.density->cbeginValueOn(); v; ++v) {
        const auto component = [&] { return float(int(64 * random.uniform())) / 128; };
        if (v.isVoxelValue())
            grid->tree().setValue(v.getCoord(), {component(), component(), component()});
    }
    return grid;
}

/// Three parts that meet, in the order of their names, with negative coordinates. The second has a
/// tile and no colour, the third one direction everywhere. Half floats hold all values.
Volume threeParts()
{
    Volume volume;
    Random random(2);
    for (const char* material : {"bark", "leaf", "up"}) {
        VolumePart& part = volume.parts.emplace_back(emptyPart(0.25));
        part.material = material;
        part.kind = part.material == "up" ? MaterialKind::fibre : MaterialKind::surface;
        for (int i = 0; i < 400; ++i) {
            const auto at = [&] { return int(random.uniform() * 40) - 20; };
            const int x = at(), y = at(), z = at();
            part.density->tree().setValue({x, y, z}, float(1 + int(64 * random.uniform())) / 8);
        }
        if (part.material == "leaf")
            part.density->sparseFill(openvdb::CoordBBox(Coord(128), Coord(159)), 2.0f, true);
        part.direction = randomVectors(part, random);
        if (part.material != "leaf") part.colour = randomVectors(part, random);
    }
    for (auto v = volume.parts[2].direction->beginValueOn(); v; ++v) v.setValue({0, 0.75f, 0});
    return volume;
}

/// All that rays see, place by place. `tree` may have leaves of 512 records for tiles of
/// `expected`.
void expectSame(const VoxelTree& tree, const VoxelTree& expected)
{
    ASSERT_EQ(tree.parts().size(), expected.parts().size());
    for (std::size_t p = 0; p < tree.parts().size(); ++p) {
        EXPECT_EQ(tree.parts()[p].material, expected.parts()[p].material);
        EXPECT_EQ(tree.parts()[p].kind, expected.parts()[p].kind);
    }
    EXPECT_EQ(tree.voxelSize(), expected.voxelSize());
    EXPECT_EQ(tree.origin(), expected.origin());
    EXPECT_EQ(tree.voxelCount(), expected.voxelCount());
    EXPECT_EQ(tree.bounds(), expected.bounds());
    EXPECT_EQ(tree.maxDensity(), expected.maxDensity());
    EXPECT_EQ(tree.isDirected(), expected.isDirected());
    std::size_t places = 0, others = 0;
    tree.forEachCell([&](const Coord&, int) { ++places; });
    expected.forEachCell([&](const Coord& origin, int other) {
        ++others;
        const int leaf = tree.leafAt(origin[0], origin[1], origin[2]);
        ASSERT_NE(leaf, VoxelTree::kEmpty);
        for (int n = 0; n < kLeafSize; ++n) {
            ASSERT_EQ(tree.densities(leaf)[n], expected.densities(other)[n]);
            if (!(tree.densities(leaf)[n] > 0)) continue;
            ASSERT_EQ(tree.scatterRatio(leaf, n), expected.scatterRatio(other, n));
            std::vector<VoxelContent> a, b;
            tree.contents(leaf, n, [&](const VoxelContent& c) { a.push_back(c); });
            expected.contents(other, n, [&](const VoxelContent& c) { b.push_back(c); });
            ASSERT_EQ(a.size(), b.size());
            for (std::size_t i = 0; i < a.size(); ++i) {
                ASSERT_EQ(a[i].part, b[i].part);
                ASSERT_EQ(a[i].density, b[i].density);
                ASSERT_EQ(a[i].spread_code, b[i].spread_code);
                ASSERT_EQ(a[i].direction, b[i].direction);
                ASSERT_EQ(a[i].colour, b[i].colour);
            }
        }
    });
    EXPECT_EQ(places, others);
}

/// Writes grids as another program would.
fs::path writeGrids(const fs::path& file, const openvdb::GridPtrVec& grids)
{
    openvdb::io::File out(file.string());
    out.write(grids);
    return file;
}

} // namespace

TEST(VoxelTree, HoldsTheVoxelsOfTheGrids)
{
    const Volume volume = threeParts();
    const VoxelTree tree(volume);
    std::uint64_t count = 0;
    for (int x = -24; x < 24; ++x)
        for (int y = -24; y < 24; ++y)
            for (int z = -24; z < 24; ++z) {
                float sum = 0;
                for (const VolumePart& part : volume.parts)
                    sum += part.density->tree().getValue({x, y, z});
                ASSERT_EQ(tree.density(x, y, z), sum);
                count += sum > 0;
            }
    EXPECT_EQ(tree.density(140, 150, 159), 2);
    EXPECT_EQ(tree.density(140, 150, 160), 0);
    EXPECT_EQ(tree.voxelCount(), count + 32 * 32 * 32);
}

TEST(VoxelTree, APackedVolumeMakesTheTreeOfItsGrids)
{
    Volume volume = threeParts();
    volume.parts[0].scatter_ratio = volume.parts[0].direction;
    const PackedVolume packed = pack(volume);
    expectSame(VoxelTree(PackedSource(packed)), VoxelTree(unpack(packed)));
    expectSame(VoxelTree(PackedSource(packed)), VoxelTree(volume));
}

// Where parts meet, a voxel's scatter ratio is their mean weighed by density; 1 for a part without.
TEST(VoxelTree, ScatterRatiosOfPartsThatMeetAreMixed)
{
    Volume volume = emptyVolume();
    volume.parts.push_back(emptyPart());
    volume.parts.push_back(emptyPart());
    const float densities[3] = {1, 3, 4};
    const Vec3f ratios[2] = {Vec3f(0.5f, 1, 2), Vec3f(1.5f, 0.2f, 1)};
    for (std::size_t p = 0; p < 3; ++p) {
        VolumePart& part = volume.parts[p];
        part.material = std::string(1, char('a' + p));
        part.density->tree().setValue(Coord(1, 2, 3), densities[p]);
        if (p == 2) continue;
        part.scatter_ratio = openvdb::Vec3SGrid::create(Vec3f(0.0f));
        part.scatter_ratio->setTransform(part.density->transformPtr());
        part.scatter_ratio->tree().setValue(Coord(1, 2, 3), ratios[p]);
    }
    const VoxelTree tree(volume);
    const ScatterRatio s = tree.scatterRatio(tree.leafAt(1, 2, 3), VoxelTree::offset(1, 2, 3));
    for (int i = 0; i < 3; ++i)
        EXPECT_NEAR(s[std::size_t(i)], (ratios[0][i] + 3 * ratios[1][i] + 4) / 8, 1e-6) << i;
}

TEST(VoxelTree, IsReadFromAFileAsTheVolumeIs)
{
    const TemporaryFolder folder;
    writeVolume(folder / "a.vdb", threeParts());
    const VoxelTree tree = readVoxelTree(folder / "a.vdb");
    expectSame(tree, VoxelTree(readVolume(folder / "a.vdb")));
    expectSame(tree, VoxelTree(threeParts()));
}

TEST(VoxelTree, IsWrittenToAFileAndReadBack)
{
    const TemporaryFolder folder;
    const VoxelTree tree = VoxelTree::coarser(VoxelTree(threeParts()), 1);
    writeVolume(folder / "a.vdb", packedVolume(tree));
    const VoxelTree back = readVoxelTree(folder / "a.vdb");
    EXPECT_EQ(back.voxelCount(), tree.voxelCount());
    EXPECT_EQ(back.bounds(), tree.bounds());
    tree.forEachCell([&](const Coord& origin, int leaf) {
        const int other = back.leafAt(origin[0], origin[1], origin[2]);
        for (int n = 0; n < kLeafSize; ++n) {
            const float density = tree.densities(leaf)[n];
            ASSERT_NEAR(back.densities(other)[n], density, density / 2000);
            if (!(density > 0)) continue;
            for (int k = 0; k < 3; ++k)
                ASSERT_NEAR(back.scatterRatio(other, n)[k], tree.scatterRatio(leaf, n)[k], 1e-3);
        }
    });
}

TEST(VoxelTree, BadFilesAndDensitiesAreNamed)
{
    const TemporaryFolder folder;
    writeVolume(folder / "whole.vdb", threeParts());
    const std::string whole = folder.read("whole.vdb");
    for (int k = 0; k < 16; ++k) {
        const fs::path cut = folder.write("cut.vdb", whole.substr(0, whole.size() * k / 16));
        EXPECT_NE(messageOf([&] { readVoxelTree(cut); }).find("cut.vdb"), std::string::npos) << k;
    }
    for (const float bad : {-1.0f, NAN, INFINITY}) {
        const auto density = openvdb::FloatGrid::create(0.0f);
        density->setName("density");
        density->tree().setValue(Coord(1, 2, 3), 1.0f);
        density->tree().setValue(Coord(4, 5, 6), bad);
        const fs::path file = writeGrids(folder / "bad.vdb", {density});
        const std::string message = messageOf([&] { readVoxelTree(file); });
        EXPECT_NE(message.find("bad.vdb: grid 'density', voxel (4, 5, 6)"), std::string::npos)
            << message;
    }
}

// Tiles are found by their values, and NaN is equal to nothing, not even in order.
TEST(VoxelTree, ATileOfNaNBesideOthersIsAnError)
{
    Volume volume = emptyVolume();
    auto& tree = volume.parts[0].density->tree();
    tree.addTile(1, Coord(0), 0.5f, true);
    tree.addTile(1, Coord(8, 0, 0), NAN, true);
    tree.addTile(1, Coord(16, 0, 0), 0.5f, true);
    const std::string message = messageOf([&] { const VoxelTree t(volume); });
    EXPECT_NE(message.find("voxel (8, 0, 0)"), std::string::npos) << message;
}

TEST(VoxelTree, TilesOfTheSameValuesShareALeaf)
{
    Volume volume = emptyVolume();
    auto& density = volume.parts[0].density->tree();
    density.addTile(2, Coord(-128, 0, 0), 0.5f, true); // 128^3
    density.addTile(2, Coord(128, 0, 0), 0.5f, true);
    density.addTile(1, Coord(8, 0, 0), 0.5f, true); // 8^3
    density.addTile(1, Coord(16, 0, 0), 0.25f, true);
    const VoxelTree tree(volume);
    EXPECT_EQ(tree.leafCount(), 2u);
    EXPECT_EQ(tree.voxelCount(), 2u * 128 * 128 * 128 + 2 * 512);
    EXPECT_EQ(tree.density(-1, 127, 127), 0.5f);
    EXPECT_EQ(tree.density(15, 7, 7), 0.5f);
    EXPECT_EQ(tree.density(16, 0, 0), 0.25f);
    EXPECT_EQ(tree.density(24, 0, 0), 0);
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

// Rays through random voxels, level by level: the mean transmittance stays, while with mean
// densities it would fall.
TEST(VoxelTree, RandomVolumesKeepTheirMeanTransmittance)
{
    VoxelTree level(noise({{-5, 0, -16}, 64, 0.15, 0.8, 3}));
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

// Two directions at an angle 2a in equal parts: the spread follows tan a, and gamma is widened by
// the closed form.
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
        EXPECT_NEAR(spreadOf(content.spread_code), spread, 0.5 / 62 + 1e-3);
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

} // namespace volcomp
