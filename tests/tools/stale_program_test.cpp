// SPDX-License-Identifier: Apache-2.0
// Boxes and volumes that the scene would make otherwise are refused, and no others.
#include <regex>

#include "tests/tools/programs.h"

namespace volcomp {
namespace {

TEST_F(Programs, ABoxThatTheSceneWouldBakeOtherwiseIsRefused)
{
    ASSERT_EQ(bake().status, 0);
    writeSceneWith("length = 0.2", "length = 0.3");
    expectFailure(compose(),
                  {"boxes/tuft_1.vdb", "box.tuft.level.1.length was 0.2 and is 0.3 now",
                   "volcomp-bake", "--allow-stale"},
                  "volume.vdb");
    const Outcome allowed = compose("--allow-stale");
    EXPECT_EQ(allowed.status, 0) << allowed.output;
    EXPECT_NE(allowed.output.find("box.tuft.level.1.length"), std::string::npos);
    // What was composed of it is not what this scene makes, but what was baked anew is.
    expectFailure(render(), {"volume.vdb", "box.tuft has changed"}, "a.exr");
    bakeAndCompose();
    EXPECT_EQ(render().status, 0);
}

TEST_F(Programs, AKindOfMaterialIsBakedIn)
{
    ASSERT_EQ(bake().status, 0);
    writeSceneWith("kind = \"fibre\"", "kind = \"surface\"");
    expectFailure(compose(), {"material.fur.kind was fibre and is surface now"}, "volume.vdb");
}

TEST_F(Programs, AVolumeOfOtherPlacementsOrSurfacesIsRefused)
{
    bakeAndCompose();
    writeSceneWith("density = 60", "density = 70");
    expectFailure(render(),
                  {"volume.vdb", "layer.fur.density was 60 and is 70 now", "volcomp-compose",
                   "--allow-stale"},
                  "a.exr");
    EXPECT_EQ(render("-o a.exr --allow-stale").status, 0);
    std::filesystem::remove(path("a.exr"));
    writeSceneWith("skin = \"skin\"", "");
    expectFailure(render(), {"surface.ground.skin"}, "a.exr");
    writeSceneWith({{"name = \"fur\"", "name = \"fur\"\nsurface = \"ground\""},
                    {"[compose]",
                     "[surface.wall]\nground = [1, 1]\nskin = \"skin\"\nskin_as = "
                     "\"voxels\"\n\n[compose]"}});
    expectFailure(render(), {"surface.wall.", "is new"}, "a.exr");
    // The files that the scene names count by their content.
    write("scene.toml", kScene);
    const std::string mesh = read("ground.obj");
    write("ground.obj", std::regex_replace(mesh, std::regex("-0.5 0 0.5"), "-0.6 0 0.5"));
    expectFailure(render(), {"surface.ground.mesh content has changed"}, "a.exr");
    write("ground.obj", mesh);
    EXPECT_EQ(render().status, 0);
    write("where.pgm", "P2\n2 1\n255\n255 129\n");
    expectFailure(render("-o b.exr"), {"layer.fur.where content has changed"}, "b.exr");
}

TEST_F(Programs, WhatDoesNotCountIsFresh)
{
    bakeAndCompose();
    const auto fresh = [&](const char* what) {
        const Outcome composed = compose(), rendered = render();
        EXPECT_EQ(composed.status, 0) << what << composed.output;
        EXPECT_EQ(rendered.status, 0) << what << rendered.output;
        EXPECT_EQ(composed.output.find("otherwise"), std::string::npos) << what;
        EXPECT_EQ(rendered.output.find("otherwise"), std::string::npos) << what;
    };
    fresh("nothing");
    writeSceneWith({{"direction = [-1, -2, -1]", "direction = [1, -2, -1]\nstrength = [2, 2, 2]"},
                    {"eye = [0, 1.5, 2.0]", "eye = [0, 1.6, 2.0]"},
                    {"kind = \"fibre\"", "kind = \"fibre\"\nalpha = 0.5"},
                    {"width = 48", "width = 50"}});
    fresh("light, camera, shading, size");
    // A comment, another form of a number, a default that is written out, another order of keys.
    writeSceneWith({{"count = 12", "spread = 5e-2 # so wide"},
                    {"spread = 0.05", "count = 12\nfrizz = 0.0"},
                    {"angle_degrees = [0, 20]", "angle_degrees = [0.0, 2e1]"}});
    fresh("form");
    // A volume that options have changed on purpose.
    write("scene.toml", kScene);
    EXPECT_EQ(compose("--voxel 0.03").status, 0);
    EXPECT_EQ(render().status, 0);
    writeSceneWith("[compose]", "[surface.wall]\nground = [1, 1]\n\n[compose]");
    std::string text = read("scene.toml");
    write("scene.toml",
          std::regex_replace(text, std::regex("name = \"fur\""),
                             "name = \"fur\"\nsurface = \"ground\""));
    EXPECT_EQ(compose("--leave-out wall").status, 0);
    const Outcome left_out = render();
    EXPECT_EQ(left_out.status, 0) << left_out.output;
}

TEST_F(Programs, ASceneOfLightsAloneShowsAnyVolume)
{
    bakeAndCompose();
    write("scene.toml",
          "[material.fur]\nkind = \"fibre\"\n[material.skin]\nkind = \"surface\"\n"
          "[camera]\neye = [0, 1.5, 2.0]\ntarget = [0, 0, 0]\n[[light]]\n"
          "[render]\nwidth = 48\nheight = 32\n");
    const Outcome rendered = render();
    EXPECT_EQ(rendered.status, 0) << rendered.output;
    // Inputs that are not there are not compared.
    write("scene.toml", kScene);
    std::filesystem::remove(path("ground.obj"));
    EXPECT_EQ(render().status, 0);
}

TEST_F(Programs, PicturesAndPlacementsCarryTheHash)
{
    bakeAndCompose();
    ASSERT_EQ(compose("--placements p.ply --stats c.json").status, 0);
    ASSERT_EQ(render("-o a.exr --stats r.json").status, 0);
    const std::string hash = readJson("c.json")["recipe"], picture = readJson("r.json")["recipe"];
    EXPECT_TRUE(std::regex_match(hash, std::regex("[0-9a-f]{16}"))) << hash;
    EXPECT_NE(read("p.ply").find("comment recipe " + hash + "\n"), std::string::npos);
    EXPECT_NE(read("a.exr").find(picture), std::string::npos);
    // Another light is another picture of the same volume.
    writeSceneWith("direction = [-1, -2, -1]", "direction = [1, -2, -1]");
    ASSERT_EQ(render("-o b.exr --stats s.json").status, 0);
    EXPECT_NE(readJson("s.json")["recipe"], picture);
    EXPECT_NE(read("a.exr").find("volcomp/recipe"), std::string::npos);
}

} // namespace
} // namespace volcomp
