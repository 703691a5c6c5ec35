// SPDX-License-Identifier: Apache-2.0
// How the programs take scenes: through a pipe, without boxes or lights, with mistakes.
#include <algorithm>
#include <cstdlib>
#include <string>

#include <gtest/gtest.h>

#include "tests/tools/programs.h"
#include "volcomp/view/image.h"

namespace volcomp {
namespace {

// The programs read /dev/stdin to its end, and relative paths start from the current folder.
TEST_F(Programs, AScenePassesThroughAPipe)
{
    bakeAndCompose();
    const auto piped = [&](const std::string& arguments) {
        const std::string command = "cd '" + path("").string()
            + "' && cat scene.toml | '" VOLCOMP_BIN "/volcomp-" + arguments + " >log.txt 2>&1";
        EXPECT_EQ(std::system(command.c_str()), 0) << read("log.txt");
    };
    piped("bake' /dev/stdin -o piped");
    for (const char* box : {"/tuft_1.vdb", "/tuft_2.vdb"})
        EXPECT_EQ(readBody(std::string("piped") + box), readBody(std::string("boxes") + box));
    piped("compose' /dev/fd/0 --boxes boxes -o piped.vdb");
    EXPECT_EQ(readBody("piped.vdb"), readBody("volume.vdb"));
    const Outcome chart = run("chart", "/dev/null -o chart");
    if (chart.output.find("gnuplot") == std::string::npos)
        expectFailure(chart, {"/dev/null", "a device"}, "chart");
}

TEST_F(Programs, ASceneWithoutBoxesIsBaked)
{
    const std::string scene = kScene;
    write("scene.toml",
          scene.substr(0, scene.find("[box.tuft]"))
              + scene.substr(scene.find("[surface.ground]"),
                             scene.find("[[layer]]") - scene.find("[surface.ground]"))
              + scene.substr(scene.find("[compose]")));
    const Outcome baked = bake();
    EXPECT_EQ(baked.status, 0) << baked.output;
    EXPECT_NE(baked.output.find("scene.toml: no boxes"), std::string::npos) << baked.output;
    const Outcome composed = compose();
    EXPECT_EQ(composed.status, 0) << composed.output;
    expectFailure(run("bake", "scene.toml -o none --box tuft"), {"[box.tuft]"}, "none");
}

TEST_F(Programs, EachPrintsTheWarningsOfTheScene)
{
    writeSceneWith("angle_degrees",
                   "[[box.tuft.level]]\ncount = 3\nlength = 0.01\nradius = 0.001\nspread = 0.05");
    const std::string warning = "grows on 'level1', the level above it, as it has no 'parent'";
    for (const Outcome& outcome : {bake(), compose(), render()}) {
        EXPECT_EQ(outcome.status, 0) << outcome.output;
        EXPECT_NE(outcome.output.find(warning), std::string::npos) << outcome.output;
    }
}

// Without lights the volume is black; a background is not.
TEST_F(Programs, APictureWithoutLightsWarnsOfTheVolume)
{
    bakeAndCompose();
    writeSceneWith({{"[[light]]", ""}, {"direction", ""}});
    const Outcome outcome = render();
    EXPECT_EQ(outcome.status, 0) << outcome.output;
    EXPECT_NE(outcome.output.find("no ambient light: the volume will be black"), std::string::npos)
        << outcome.output;
}

// An image of a sky with one bright texel: it shines as a light of its own name, and the rest of
// the picture shows the sky. A changed image is another picture.
TEST_F(Programs, ADomesImageIsSeenAndItsSunShines)
{
    Image sky;
    sky.width = 128;
    sky.height = 64;
    sky.channels = {"R", "G", "B"};
    sky.pixels.assign(std::size_t(3) * 128 * 64, 0.25f);
    const auto render_with = [&](float sun, const std::string& more) {
        for (int c = 0; c < 3; ++c) sky.pixel(80, 20)[c] = sun;
        writeImage(path("sky.exr"), sky);
        return render(more);
    };
    bakeAndCompose();
    writeSceneWith({{"[[light]]", "[[light]]\nname = \"sun\""},
                    {"height = 32",
                     "height = 32\naovs = true\n[dome]\nkind = \"image\"\nimage = "
                     "\"sky.exr\""}});
    const Outcome outcome = render_with(1e4f, "-o a.exr --stats a.json");
    ASSERT_EQ(outcome.status, 0) << outcome.output;
    EXPECT_NE(outcome.output.find("sky.exr: a sun in it shines as light 'sun2': direction ("),
              std::string::npos)
        << outcome.output;
    const Image picture = readImage(path("a.exr"));
    EXPECT_NE(std::find(picture.channels.begin(), picture.channels.end(), "sun2.R"),
              picture.channels.end());
    EXPECT_NEAR(picture.pixel(0, 0)[0], 0.25, 1e-4);
    EXPECT_EQ(picture.pixel(0, 0)[3], 1);
    EXPECT_EQ(render_with(1e4f, "-o b.exr --no-background").status, 0);
    EXPECT_EQ(readImage(path("b.exr")).pixel(0, 0)[3], 0);
    const auto recipe = readJson("a.json")["recipe"];
    EXPECT_EQ(render_with(0.25f, "-o c.exr --stats c.json").status, 0);
    EXPECT_NE(readJson("c.json")["recipe"], recipe);
    EXPECT_NE(render("-o sky.exr").status, 0) << "it would write over the image";

    const Outcome negative = render_with(-1, "-o d.exr");
    EXPECT_EQ(negative.status, 1);
    EXPECT_NE(negative.output.find("sky.exr: pixel (80, 20): expected finite values >= 0"),
              std::string::npos)
        << negative.output;
}

} // namespace
} // namespace volcomp
