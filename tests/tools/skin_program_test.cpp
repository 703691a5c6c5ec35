// SPDX-License-Identifier: Apache-2.0
// Skins that are meshes through the programs: composing leaves them out, rendering traces them, and
// the exact picture agrees.
#include <cmath>

#include "tests/tools/programs.h"
#include "tools/shared/picture_error.h"
#include "tools/truth/exact_picture.h"
#include "volcomp/view/image.h"

namespace volcomp {
namespace {

constexpr const char* kWall = R"(
[material.wall]
kind = "surface"
alpha = 0.8
beta = 0.0

[surface.wall]
ground = [4, 4]
skin = "wall"
skin_colour = [1, 0.5, 0.25]

[camera]
projection = "orthographic"
eye = [0, 3, 0]
target = [0, 0, 0]
up = [0, 0, -1]
width = 1.0

[[light]]
direction = [1.7320508, -1, 0]

[render]
width = 32
height = 32
samples = 4
)";

class Skins : public Programs {
protected:
    Image picture(const std::string& shadows, const std::string& more = "")
    {
        const Outcome rendered = render("-o a.exr --shadows " + shadows + " " + more);
        EXPECT_EQ(rendered.status, 0) << rendered.output;
        return readImage(path("a.exr"));
    }
    Image truth(int samples)
    {
        const Outcome traced =
            run("truth", "scene.toml -o truth.exr --samples " + std::to_string(samples));
        EXPECT_EQ(traced.status, 0) << traced.output;
        return readImage(path("truth.exr"));
    }
};

TEST_F(Skins, ASceneOfNothingButSkinsRenders)
{
    write("scene.toml", kWall);
    ASSERT_EQ(bake().status, 0);
    const Outcome composed = compose();
    ASSERT_EQ(composed.status, 0) << composed.output;
    EXPECT_NE(composed.output.find("the volume has no voxels"), std::string::npos)
        << composed.output;
    const Image exact = truth(4);
    for (const char* shadows : {"exact", "sweep", "none"}) {
        const Image image = picture(shadows);
        for (int y = 0; y < 32; ++y)
            for (int x = 0; x < 32; ++x)
                for (int c = 0; c < 3; ++c) {
                    EXPECT_NEAR(image.pixel(x, y)[c], 0.4 / (1 << c), 1e-5);
                    EXPECT_NEAR(image.pixel(x, y)[c], exact.pixel(x, y)[c], 1e-5);
                }
    }
}

TEST_F(Skins, AsVoxelsTheShellIsInTheVolumeAndNotTraced)
{
    write("scene.toml", std::string(kWall) + "[compose]\nvoxel = 0.02\n");
    ASSERT_EQ(bake().status, 0);
    ASSERT_EQ(compose("--stats mesh.json").status, 0);
    EXPECT_EQ(readJson("mesh.json")["active_voxels"], 0);
    std::string text = read("scene.toml");
    text.insert(text.find("skin_colour"), "skin_as = \"voxels\"\nskin_depth = 1\n");
    write("scene.toml", text);
    expectFailure(render(), {"volume.vdb", "surface.wall."}, "a.exr"); // made without the shell
    ASSERT_EQ(compose("--stats voxels.json").status, 0);
    EXPECT_GT(readJson("voxels.json")["active_voxels"], 10000);
    const Outcome rendered = render("-o a.exr --stats r.json");
    ASSERT_EQ(rendered.status, 0) << rendered.output;
    EXPECT_FALSE(readJson("r.json").contains("skins"));
    EXPECT_EQ(rendered.output.find("counts only"), std::string::npos) << rendered.output;
    // The keys of shells mean nothing for a mesh.
    text.erase(text.find("skin_as"), text.find("skin_depth") - text.find("skin_as"));
    write("scene.toml", text);
    const Outcome warned = compose();
    EXPECT_EQ(warned.status, 0);
    EXPECT_NE(warned.output.find("'skin_depth' counts only with skin_as = \"voxels\""),
              std::string::npos)
        << warned.output;
}

TEST_F(Skins, AVolumeIsStaleByWhatItHoldsAndAPictureByItsSkins)
{
    const std::string wall = "[surface.wall]\nmesh = \"wall.obj\"\nskin = \"skin\"\n\n[[layer]]";
    write("wall.obj", kMesh);
    writeSceneWith({{"skin_as", ""},
                    {"[[layer]]", wall},
                    {"name = \"fur\"", "name = \"fur\"\nsurface = \"ground\""}});
    bakeAndCompose();
    const auto recipeOf = [&](const std::string& more = "") {
        const Outcome rendered = render("-o a.exr --stats r.json " + more);
        EXPECT_EQ(rendered.status, 0) << rendered.output;
        EXPECT_EQ(rendered.output.find("otherwise"), std::string::npos) << rendered.output;
        return readJson("r.json")["recipe"].get<std::string>();
    };
    const std::string before = recipeOf(), text = read("scene.toml");
    EXPECT_EQ(readJson("r.json")["skins"]["meshes"], 2);
    // A colour, and a mesh on which nothing stands: another picture of the same volume.
    std::string other = text;
    other.insert(other.find("skin = \"skin\""), "skin_colour = [0.1, 0.2, 0.3]\n");
    write("scene.toml", other);
    EXPECT_NE(recipeOf(), before);
    write("scene.toml", text);
    EXPECT_EQ(recipeOf(), before);
    write("wall.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    EXPECT_NE(recipeOf(), before);
    write("wall.obj", kMesh);
    // The mesh on which boxes stand moves them.
    write("ground.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n");
    std::filesystem::remove(path("a.exr"));
    expectFailure(render(), {"surface.ground.mesh content has changed"}, "a.exr");
    write("ground.obj", kMesh);
    // What was left out of the volume is not traced either.
    ASSERT_EQ(compose("--leave-out wall").status, 0);
    EXPECT_NE(recipeOf(), before);
    EXPECT_EQ(readJson("r.json")["skins"]["meshes"], 1);
    std::filesystem::remove(path("wall.obj"));
    EXPECT_NE(recipeOf(), before);
    // A mesh that is missing says so.
    ASSERT_NE(compose().status, 0);
    std::filesystem::remove(path("ground.obj"));
    expectFailure(render("-o b.exr --allow-stale"), {"ground.obj"}, "b.exr");
}

TEST_F(Skins, UnderFurTheWallShowsTheSameTimesTheFursTransmittance)
{
    // Black hairs, so that only the wall shines. Composing spreads them over more voxels than they
    // fill, so that dense fur of coarse voxels is darker than its hairs, with and without a skin;
    // this is thin fur of fine ones.
    std::string text = std::string(kWall) + R"(
[material.hair]
kind = "fibre"
alpha = 0.0
beta = 0.0

[box.tuft]
material = "hair"
variants = 4
voxel = 0.002

[[box.tuft.level]]
count = 8
spread = 0.02
length = 0.1
length_variation = 0.2
radius = 0.001
segments = 4
angle_degrees = [0, 35]

[[layer]]
box = "tuft"
surface = "wall"
density = 200

[compose]
voxel = 0.001
)";
    text.replace(text.find("ground = [4, 4]"), 15, "ground = [1.2, 1.2]");
    text.replace(text.find("direction = [1.7320508, -1, 0]"), 30, "direction = [0.7, -1, 0.3]");
    text.replace(text.find("eye = [0, 3, 0]"), 15, "eye = [1, 3, 0.3]");
    write("scene.toml", text);
    bakeAndCompose();
    const Image exact = truth(64);
    for (const char* shadows : {"exact", "sweep"}) {
        const PictureError e = pictureError(picture(shadows), exact);
        EXPECT_LT(e.mean, 0.3); // bare it shows 0.37
        EXPECT_LT(std::abs(e.bias), 0.02) << shadows;
        EXPECT_LT(e.block_rmse, 0.06) << shadows;
        EXPECT_LT(std::abs(e.alpha_bias), 1e-6);
    }
    // The same volume by itself: its transmittance in every pixel.
    const Image wall = picture("none");
    text.erase(text.find("skin = \"wall\""), 13);
    write("scene.toml", text);
    const Image fur = picture("none");
    const double bare = 0.8 / std::sqrt(0.49 + 1 + 0.09);
    double passes = 0, shown = 0;
    for (int y = 0; y < 32; ++y)
        for (int x = 0; x < 32; ++x) {
            passes += (1 - fur.pixel(x, y)[3]) / 1024;
            shown += wall.pixel(x, y)[0] / 1024;
        }
    EXPECT_GT(passes, 0.6);
    EXPECT_LT(passes, 0.95);
    // Half of a root's first voxel lies below the wall, which ends the rays.
    EXPECT_NEAR(shown / (bare * passes), 1, 0.02);
}

TEST_F(Skins, ATextureWithAlphaIsCutOutAsInTheExactPicture)
{
    Image leaf; // a disc of a colour that varies
    leaf.width = leaf.height = 64;
    leaf.channels = {"R", "G", "B", "A"};
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 64; ++x) {
            const double r = std::hypot(x - 31.5, y - 31.5) / 32;
            for (const double v : {0.2 + 0.6 * x / 63, 0.9 - 0.5 * y / 63, 0.3, double(r < 0.9)})
                leaf.pixels.push_back(float(v));
        }
    writeImage(path("leaf.exr"), leaf);
    std::string text = kWall;
    text.insert(text.find("skin_colour"),
                "skin_map = [{image = \"leaf.exr\", wrap = \"black\"}]\n");
    text.replace(text.find("ground = [4, 4]"), 15, "ground = [0.5, 0.5]\ntranslate = [0, 0.5, 0]");
    write("scene.toml", text + "[surface.floor]\nground = [3, 3]\nskin = \"wall\"\n");
    ASSERT_EQ(bake().status, 0);
    ASSERT_EQ(compose().status, 0);
    const Image exact = truth(256), image = picture("exact", "--samples 256");
    const PictureError e = pictureError(image, exact);
    EXPECT_LT(std::abs(e.bias), 0.003);
    EXPECT_LT(e.rmse, 0.03);
    EXPECT_NEAR(image.pixel(0, 16)[0], 0.4, 1e-5); // the floor
    EXPECT_LT(image.pixel(16, 16)[0], 0.3);        // the leaf
}

} // namespace
} // namespace volcomp
