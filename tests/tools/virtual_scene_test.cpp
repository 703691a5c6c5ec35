// SPDX-License-Identifier: Apache-2.0
// What a program makes of a scene file and box files, without a volume file between.
#include "tools/shared/virtual_scene.h"

#include "tests/support/message_of.h"
#include "tests/tools/programs.h"
#include "volcomp/base/node_index.h"
#include "volcomp/compose/compose.h"
#include "volcomp/volume/block_source.h"
#include "volcomp/volume/vdb_io.h"

namespace volcomp {
namespace {

using openvdb::Coord;

/// The scene in a folder, with its boxes, at voxels of 1, 2 and 4 cm.
VirtualScene virtualSceneOf(const std::filesystem::path& folder, Stale stale = Stale::refused)
{
    openvdb::initialize();
    Tool tool("virtual_scene_test", "");
    const Scene scene = readScene(folder / "scene.toml");
    VirtualSceneOptions options;
    options.boxes = folder / "boxes";
    options.stale = stale;
    options.voxels = [&](const PlacedScene& placed, const std::vector<BoxSize>& boxes) {
        EXPECT_EQ(boxes.size(), 2u);
        for (std::size_t b = 0; b < boxes.size(); ++b) {
            const Box box{"tuft", int(b), readVolume(boxFile(options.boxes, "tuft", int(b)))};
            EXPECT_EQ(boxes[b].voxel, box.volume.voxelSize());
            EXPECT_GT(boxes[b].ball.radius, 0);
            EXPECT_EQ(boxes[b].ball.radius, ballOf(box).radius);
            EXPECT_EQ(boxes[b].ball.centre, ballOf(box).centre);
        }
        EXPECT_FALSE(placed.boxes.empty());
        return VoxelRange{0.01, 3};
    };
    return virtualScene(tool, scene, options);
}

std::size_t particles(const BlockVoxels& block)
{
    std::size_t count = 0;
    for (const PartVoxels& part : block) count += part.density.size();
    return count;
}

TEST_F(Programs, AVirtualSceneHoldsWhatTheComposedFileHolds)
{
    bakeAndCompose(); // at 2 cm
    VirtualScene made = virtualSceneOf(path(""));
    VirtualScene moved = std::move(made);
    ASSERT_EQ(moved.composite->levels(), 3);
    EXPECT_EQ(moved.composite->voxel(1), 0.02);
    const Recipe file = recipeOf(readVolumeMetadata(path("volume.vdb")));
    Recipe placed; // what the file's says but the voxel and other options
    std::string voxel;
    for (const auto& [name, value] : file.entries()) {
        if (name == std::string(kOption) + "voxel") voxel = value;
        if (name.rfind(kOption, 0) != 0) placed.add(name, value);
    }
    EXPECT_EQ(moved.recipe.text(), placed.text());
    EXPECT_EQ(voxel, "0.02");

    const VolumeSource whole(readVolume(path("volume.vdb")));
    const TileMaker& level = moved.composite->level(1);
    ASSERT_EQ(level.parts().size(), whole.parts().size());
    TileVoxels tile;
    BlockVoxels block;
    std::size_t blocks = 0;
    for (const Coord& node : whole.nodes()) {
        const NodeBlocks in_node = whole.blocks(node);
        for (int n = 0; n < kNodeSize; ++n) {
            if (!in_node.voxels[std::size_t(n)]) continue;
            const Coord leaf = node + leafInNode(n);
            level.make(leaf & ~(kTileDim - 1), tile);
            whole.take(leaf, block);
            const std::size_t l = std::size_t(leaf[0] >> 3 & 1) * 4
                + std::size_t(leaf[1] >> 3 & 1) * 2 + std::size_t(leaf[2] >> 3 & 1);
            EXPECT_EQ(particles(tile[l]), particles(block)) << leaf;
            for (std::size_t p = 0; p < block.size(); ++p)
                EXPECT_EQ(tile[l][p].mask, block[p].mask);
            ++blocks;
        }
    }
    EXPECT_GT(blocks, 100u);
}

TEST_F(Programs, AVirtualSceneRefusesTheBoxesThatComposingRefuses)
{
    EXPECT_NE(messageOf([&] { virtualSceneOf(path("")); }).find("Run volcomp-bake first"),
              std::string::npos);
    ASSERT_EQ(bake().status, 0);
    writeSceneWith("length = 0.2", "length = 0.3");
    EXPECT_NE(messageOf([&] {
                  virtualSceneOf(path(""));
              }).find("box.tuft.level.1.length was 0.2 and is 0.3 now"),
              std::string::npos);
    EXPECT_EQ(virtualSceneOf(path(""), Stale::allowed).composite->levels(), 3);
}

} // namespace
} // namespace volcomp
