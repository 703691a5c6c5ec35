// SPDX-License-Identifier: Apache-2.0
#include "volcomp/volume/block_source.h"

#include <map>

#include <gtest/gtest.h>

#include "volcomp/base/error.h"
#include "volcomp/base/random.h"
#include "volcomp/volume/packed_volume.h"
#include "tests/support/volumes.h"

namespace volcomp {
namespace {

using openvdb::Coord;

const bool kStarted = (openvdb::initialize(), true);

/// What a source says of a voxel's part.
struct Value {
    float density;
    Vec3f direction, colour, scatter_ratio;
    float own_share;
};
bool operator==(const Value& a, const Value& b)
{
    return a.density == b.density && a.direction == b.direction && a.colour == b.colour
        && a.scatter_ratio == b.scatter_ratio && a.own_share == b.own_share;
}
using Values = std::map<std::pair<Coord, std::size_t>, Value>; // by voxel and part

void addBlock(const BlockSource& source, const Coord& block, Values& values)
{
    BlockVoxels voxels(7); // of something before
    source.take(block, voxels);
    ASSERT_EQ(voxels.size(), source.parts().size());
    for (std::size_t p = 0; p < voxels.size(); ++p) {
        const PartVoxels& part = voxels[p];
        const VoxelMask may_hold = source.mayHold(block, p);
        std::size_t k = 0;
        for (int n = 0; n < kLeafSize; ++n) {
            if (!(part.mask[n >> 6] >> (n & 63) & 1)) continue;
            EXPECT_TRUE(may_hold[n >> 6] >> (n & 63) & 1);
            const Coord at = block.offsetBy(n >> 6, n >> 3 & 7, n & 7);
            const Value value{PartVoxels::at(part.density, k, 0.0f),
                              PartVoxels::at(part.direction, k, Vec3f(0.0f)),
                              PartVoxels::at(part.colour, k, Vec3f(0.0f)),
                              PartVoxels::at(part.scatter_ratio, k, Vec3f(1.0f)),
                              PartVoxels::at(part.own_share, k, 0.0f)};
            EXPECT_TRUE(values.emplace(std::pair(at, p), value).second) << at << " twice";
            ++k;
        }
        for (const std::size_t size : {part.density.size(), part.colour.size()})
            EXPECT_TRUE(k == 0 || size == 1 || size == k);
    }
}

/// All that a source holds.
Values allOf(const BlockSource& source)
{
    Values values;
    std::vector<Coord> nodes = source.nodes();
    for (std::size_t i = 1; i < nodes.size(); ++i) EXPECT_LT(nodes[i - 1], nodes[i]);
    for (const Coord& node : nodes) {
        const NodeBlocks blocks = source.blocks(node);
        EXPECT_TRUE((blocks.voxels & blocks.tiles).none());
        for (int n = 0; n < kNodeSize; ++n)
            if (blocks.voxels[n] || blocks.tiles[n]) addBlock(source, node + leafInNode(n), values);
    }
    return values;
}

/// The same, voxel by voxel from the grids. Values are those that half floats hold.
Values allOf(const Volume& volume)
{
    Values values;
    for (std::size_t p = 0; p < volume.parts.size(); ++p) {
        const VolumePart& part = volume.parts[p];
        const auto grid = part.density->deepCopy();
        grid->tree().voxelizeActiveTiles();
        for (auto v = grid->cbeginValueOn(); v; ++v) {
            if (*v == 0) continue;
            const Coord at = v.getCoord();
            const auto of = [&](const openvdb::Vec3SGrid::Ptr& g, const Vec3f& otherwise) {
                return g ? g->tree().getValue(at) : otherwise;
            };
            values[{at, p}] = {*v, of(part.direction, Vec3f(0.0f)),
                               of(part.colour, part.uniform_colour),
                               of(part.scatter_ratio, Vec3f(1.0f)),
                               part.own_share ? part.own_share->tree().getValue(at) : 0};
        }
    }
    return values;
}

openvdb::Vec3SGrid::Ptr vectors(const VolumePart& part, std::uint64_t seed)
{
    const auto grid = openvdb::Vec3SGrid::create(Vec3f(0.0f));
    grid->setTransform(part.density->transformPtr());
    Random random(seed);
    for (auto v = part.density->cbeginValueOn(); v; ++v) {
        const auto eighth = [&] { return float(int(8 * random.uniform())) / 8; };
        const Vec3f value(eighth(), eighth(), eighth());
        if (v.isVoxelValue()) grid->tree().setValue(v.getCoord(), value);
    }
    return grid;
}

/// Two parts that meet, with negative coordinates, active voxels of density 0, and two tiles
/// of 8^3 voxels, one with directions; the second part has one colour for all and no scatter ratio.
Volume parts()
{
    Volume volume = emptyVolume(0.5);
    volume.parts.push_back(emptyPart(0.5));
    Random random(3);
    for (VolumePart& part : volume.parts) {
        for (int i = 0; i < 3000; ++i) {
            const auto at = [&] { return int(random.uniform() * 300) - 150; };
            const int x = at(), y = at(), z = at();
            part.density->tree().setValue({x, y, z}, float(int(4 * random.uniform())) / 4);
        }
        part.kind = &part == &volume.parts[0] ? MaterialKind::fibre : MaterialKind::surface;
    }
    auto& first = volume.parts[0].density->tree();
    first.addTile(1, Coord(1000, 8, 16), 2.0f, true);
    first.addTile(1, Coord(1016, 8, 16), 3.0f, true);
    volume.parts[1].density->tree().setValue(Coord(1003, 9, 17), 0.5f); // in the tile
    volume.parts[0].direction = vectors(volume.parts[0], 1);
    volume.parts[0].direction->tree().setValue(Coord(1017, 9, 18), {0.5f, 0, 0}); // in a tile
    volume.parts[0].colour = vectors(volume.parts[0], 2);
    volume.parts[0].scatter_ratio = vectors(volume.parts[0], 4);
    volume.parts[1].direction = vectors(volume.parts[1], 5);
    volume.parts[1].uniform_colour = Vec3f(0.5f, 0.25f, 1);
    VolumePart& last = volume.parts[1];
    last.own_share = openvdb::FloatGrid::create(0.0f);
    last.own_share->setTransform(last.density->transformPtr());
    for (auto v = last.density->cbeginValueOn(); v; ++v)
        last.own_share->tree().setValue(v.getCoord(), float(int(8 * random.uniform())) / 8);
    return volume;
}

TEST(VolumeSource, BringsEachVoxelOnce)
{
    const Volume volume = parts();
    const VolumeSource source(volume);
    EXPECT_TRUE(source.parts()[0].has_colour);
    EXPECT_FALSE(source.parts()[1].has_colour);
    EXPECT_EQ(source.parts()[1].kind, MaterialKind::surface);
    const Values found = allOf(source), expected = allOf(volume);
    EXPECT_GT(expected.size(), 4000u);
    EXPECT_TRUE(found == expected);
    EXPECT_TRUE(allOf(source) == expected); // the grids are as before
}

TEST(VolumeSource, SaysWhichNodesAreOneTile)
{
    Volume volume = parts();
    volume.parts[0].density->tree().addTile(2, Coord(4096, 128, -128), 3.0f, true); // 128^3
    const VolumeSource source(volume);
    const NodeBlocks tile = source.blocks({4096, 128, -128});
    EXPECT_TRUE(tile.one_tile && tile.tiles.all());
    EXPECT_FALSE(source.blocks({896, 0, 0}).one_tile);
    BlockVoxels voxels;
    source.take({4096, 128, -128}, voxels);
    EXPECT_EQ(voxels[0].density, std::vector<float>{3.0f});
    EXPECT_EQ(voxels[1].mask, VoxelMask{});
}

TEST(VolumeSource, FreesWhatWasTaken)
{
    Volume volume = parts();
    const Values expected = allOf(volume);
    const auto leavesWithValues = [&] {
        int count = 0;
        for (auto leaf = volume.parts[0].direction->tree().cbeginLeaf(); leaf; ++leaf)
            count += leaf->isAllocated();
        return count;
    };
    EXPECT_GT(leavesWithValues(), 1000);
    const VolumeSource source(volume, TakenBlocks::freed);
    EXPECT_TRUE(allOf(source) == expected);
    EXPECT_EQ(leavesWithValues(), 0);
    EXPECT_TRUE(source.mayHold({1000, 8, 16}, 1)[3] >> 9 & 1); // the topology stays
}

TEST(PackedSource, BringsWhatWasPacked)
{
    Volume volume = parts();
    const PackedVolume packed = pack(volume);
    const PackedSource source(packed);
    EXPECT_TRUE(allOf(source) == allOf(volume));
    EXPECT_TRUE(source.parts()[0].has_scatter_ratio);
    EXPECT_FALSE(source.parts()[1].has_scatter_ratio);
    EXPECT_EQ(source.transform().voxelSize()[0], 0.5);
}

TEST(BlockSource, RefusesAVolumeWithoutPartsAndGridsThatDoNotMeet)
{
    EXPECT_THROW(VolumeSource(Volume{}), Error);
    PackedVolume nothing;
    EXPECT_THROW(PackedSource{nothing}, Error);
    Volume volume = parts();
    volume.parts[1].density->setTransform(openvdb::math::Transform::createLinearTransform(0.25));
    EXPECT_THROW(VolumeSource{volume}, Error);
}

} // namespace
} // namespace volcomp
