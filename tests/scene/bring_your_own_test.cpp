// SPDX-License-Identifier: Apache-2.0
// Boxes and places of other programs in scene files.
#include <gtest/gtest.h>

#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"
#include "volcomp/scene/place_scene.h"
#include "volcomp/scene/scene.h"
#include "volcomp/scene/scene_recipe.h"

namespace volcomp {
namespace {

const std::string kHead = "[material.leaf]\nkind = \"surface\"\n[material.fur]\n"
                          "[surface.ground]\nground = [4, 4]\n[surface.pond]\nground = [1, 1]\n";

class BringYourOwn : public testing::Test {
protected:
    Scene read(const std::string& text) const
    {
        return readScene(m_folder.write("scene.toml", kHead + text));
    }
    std::string failure(const std::string& text) const
    {
        return messageOf([&] { read(text); });
    }
    TemporaryFolder m_folder;
};

TEST_F(BringYourOwn, AMeshIsABoxOfOneVariant)
{
    const Scene scene = read("[box.tree]\nmaterial = \"leaf\"\nmesh = \"tree.obj\"\nup = \"z\"\n"
                             "scale = 0.01\n[[box.tree.mesh_material]]\nname = \"bark*\"\n"
                             "texture = \"bark.png\"\nsolid = \"solid\"\n");
    ASSERT_EQ(scene.boxes.size(), 1u);
    const GrowthRule& rule = scene.boxes[0];
    EXPECT_EQ(rule.variants, 1);
    EXPECT_EQ(rule.mesh.file.filename(), "tree.obj");
    EXPECT_EQ(rule.mesh.axes.up, UpAxis::z);
    ASSERT_EQ(rule.mesh.materials.size(), 1u);
    EXPECT_EQ(rule.mesh.materials[0].material, "leaf");
    EXPECT_EQ(rule.mesh.materials[0].solidity, Solidity::solid);
    // What the mesh holds is part of what the box is made from.
    m_folder.write("tree.obj", "v 0 0 0\n");
    const std::string before = boxRecipe(scene, rule).hash();
    m_folder.write("tree.obj", "v 0 0 1\n");
    EXPECT_NE(boxRecipe(scene, rule).hash(), before);
}

TEST_F(BringYourOwn, WhatDoesNotFitTogetherIsRefused)
{
    const std::string box = "[box.tree]\nmaterial = \"leaf\"\n";
    EXPECT_NE(failure(box + "scale = 2\n[[box.tree.level]]\n").find("'mesh'"), std::string::npos);
    EXPECT_NE(
        failure(box + "mesh = \"a.obj\"\n[[box.tree.level]]\n").find("or one of 'curves', 'mesh'"),
        std::string::npos);
    EXPECT_NE(failure("[box.tree]\nmaterial = \"fur\"\nmesh = \"a.obj\"\n").find("kind surface"),
              std::string::npos);
    EXPECT_NE(failure(box + "mesh = \"a.obj\"\nvariants = 2\n").find("variants"),
              std::string::npos);
    EXPECT_NE(failure(box + "mesh = \"a.obj\"\nfiles = [\"a.vdb\"]\n").find("files"),
              std::string::npos);
}

TEST_F(BringYourOwn, APlaceIsOneBoxThere)
{
    const Scene scene = read("[box.tree]\nmaterial = \"leaf\"\nfiles = [\"a.vdb\", \"b.vdb\"]\n"
                             "[[place]]\nbox = \"tree\"\nsurface = \"ground\"\nvariant = 2\n"
                             "position = [1, 2, 3]\nsize = 0.5\nturn_degrees = 90\n");
    EXPECT_EQ(scene.boxes[0].variants, 2);
    const PlacedScene placed = place(scene);
    ASSERT_EQ(placed.boxes.size(), 1u);
    const Placement& p = placed.boxes.placements[0];
    EXPECT_EQ(p.position, Vec3d(1, 2, 3));
    EXPECT_EQ(p.box, 1);
    EXPECT_EQ(p.scale, 0.5f);
    EXPECT_NEAR((p.x_axis - Vec3f(0, 0, -1)).length(), 0, 1e-6);
    EXPECT_TRUE(placed.warnings.empty());
    EXPECT_NE(failure("[box.tree]\nmaterial = \"leaf\"\nfiles = [\"a.vdb\"]\n[[place]]\n"
                      "box = \"tree\"\nsurface = \"ground\"\nvariant = 2\nposition = [0, 0, 0]\n")
                  .find("one of the box's variants"),
              std::string::npos);
}

TEST_F(BringYourOwn, OnlyWhatIsThereIsAvoided)
{
    const std::string layer =
        "[box.tree]\nmaterial = \"leaf\"\nfiles = [\"a.vdb\"]\n[[layer]]\n"
        "name = \"trees\"\nbox = \"tree\"\nsurface = \"ground\"\ndensity = 1\n"
        "[[layer.avoid]]\n";
    EXPECT_NE(failure(layer + "layer = \"trees\"\n").find("layer above"), std::string::npos);
    EXPECT_NE(failure(layer + "surface = \"ground\"\n").find("other than"), std::string::npos);
    EXPECT_NE(failure(layer + "distance = 1\n").find("either"), std::string::npos);
    EXPECT_EQ(read(layer + "surface = \"pond\"\n").layers[0].avoid.size(), 1u);
}

} // namespace
} // namespace volcomp
