// SPDX-License-Identifier: Apache-2.0
#include "volcomp/place/placed_scene.h"

#include <gtest/gtest.h>

#include "tests/support/message_of.h"

namespace volcomp {
namespace {

SurfaceSpec groundSpec(double size)
{
    SurfaceSpec s;
    s.name = "ground";
    s.terrain.width = s.terrain.depth = size;
    return s;
}

Layer layer(double density)
{
    Layer l;
    l.name = "tree";
    l.box = "oak";
    l.surface = "ground";
    l.density = density;
    return l;
}

std::vector<std::string> warningsOf(double size, const Layer& l)
{
    return place({groundSpec(size)}, {l}, {{"oak", 1}}).warnings;
}

TEST(PlacedScene, warnsOfLayersWithoutBoxes)
{
    EXPECT_TRUE(warningsOf(1, layer(50)).empty());
    // A density of 0.3 on one square metre: whether there is a box or not, chance has decided.
    const auto few = warningsOf(1, layer(0.3));
    ASSERT_EQ(few.size(), 1u);
    EXPECT_EQ(few[0].rfind("layer 'tree': ", 0), 0u);
    EXPECT_NE(few[0].find("asks for 0.3"), std::string::npos) << few[0];
    EXPECT_NE(few[0].find("sampling = \"uv\", cells = [1, 1] and density = 1"), std::string::npos);
    Layer black = layer(50);
    MapFactor zero;
    zero.constant = Vec3d(0.0);
    black.where = {zero};
    const auto none = warningsOf(1, black);
    ASSERT_EQ(none.size(), 1u);
    EXPECT_NE(none[0].find("0 boxes: its 'where'"), std::string::npos) << none[0];
    ASSERT_EQ(warningsOf(1, layer(0)).size(), 1u);
    EXPECT_NE(warningsOf(1, layer(0))[0].find("density is 0"), std::string::npos);
}

// A plane of a millimetre and a density of 1e6 are one box, and so is what the warning advises.
TEST(PlacedScene, exactlyOneBoxCanBeSaid)
{
    Layer l = layer(1e6);
    EXPECT_EQ(place({groundSpec(1e-3)}, {l}, {{"oak", 1}}).boxes.size(), 1u);
    l.sampling = Sampling::uv;
    l.cells_u = l.cells_v = 1;
    l.density = 1;
    const PlacedScene one = place({groundSpec(3)}, {l}, {{"oak", 1}});
    EXPECT_EQ(one.boxes.size(), 1u);
    EXPECT_TRUE(one.warnings.empty());
}

// 4e8 boxes would take minutes and 32 GB: the second layer is refused before.
TEST(PlacedScene, impossibleLayersAreRefusedBeforeTheFirstIsPlaced)
{
    Layer impossible = layer(1e3);
    impossible.name = "forest";
    const std::string message = messageOf([&] {
        place({groundSpec(1e6)}, {layer(4e-4), impossible}, {{"oak", 1}});
    });
    EXPECT_NE(message.find("layer 'forest': expected at most 5e+08 samples, found 1e+15"),
              std::string::npos)
        << message;
    EXPECT_NE(message.find("surface 'ground'"), std::string::npos);
}

} // namespace
} // namespace volcomp
