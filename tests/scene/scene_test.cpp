// SPDX-License-Identifier: Apache-2.0
#include "volcomp/scene/scene.h"

#include <fstream>
#include <functional>
#include <sstream>

#include <gtest/gtest.h>

#include "volcomp/base/error.h"
#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;

class SceneFile : public testing::Test {
protected:
    std::string messageOf(const std::string& text)
    {
        m_file = fs::path(testing::TempDir())
            / (std::string("scene_") + testing::UnitTest::GetInstance()->current_test_info()->name()
               + ".toml");
        std::ofstream(m_file) << text;
        try {
            readScene(m_file);
        } catch (const Error& e) {
            return e.what();
        }
        return "no error";
    }
    void TearDown() override { fs::remove(m_file); }
    fs::path m_file;
};

constexpr const char* kMaterial = "[material.fur]\nkind = \"fibre\"\n";

TEST_F(SceneFile, hazeAndPictureHaveTablesOfTheirOwn)
{
    EXPECT_EQ(messageOf("[haze]\ndensity = 0.02\nheight = 5\nbase = -1\ncolour = [0.5, 0.5, 0.5]\n"
                        "[picture]\nexposure = -1.5\ntone = 'filmic'\n"
                        "[render]\nlight_samples = 3\n"),
              "no error");
    const Scene scene = readScene(m_file);
    EXPECT_EQ(scene.render.haze.density, 0.02);
    EXPECT_EQ(scene.render.haze.height, 5);
    EXPECT_EQ(scene.render.haze.base, -1);
    EXPECT_EQ(scene.render.haze.colour, Vec3d(0.5));
    EXPECT_EQ(scene.render.light_samples, 3);
    EXPECT_EQ(scene.look.exposure, -1.5);
    EXPECT_EQ(scene.look.tone, Tone::filmic);
    EXPECT_NE(messageOf("[picture]\ntone = 'aces'\n").find(":2: picture.tone: expected"),
              std::string::npos);
    EXPECT_NE(messageOf("[haze]\ndensity = -1\n").find(":2: haze.density: expected"),
              std::string::npos);
}

TEST_F(SceneFile, namesThatNothingHasAreShownWithTheKnownOnes)
{
    const std::string box = messageOf(std::string(kMaterial) + "[box.tuft]\nmaterial = \"fuzz\"\n");
    EXPECT_NE(box.find(":4:"), std::string::npos) << box;
    EXPECT_NE(box.find("the name of a material (fur)"), std::string::npos) << box;
    const std::string layer = messageOf(
        std::string(kMaterial)
        + "[box.tuft]\nmaterial = \"fur\"\nlevel = [{}]\n[surface.a]\nmesh = \"a.obj\"\n[[layer]]\nbox = \"tuf\"\ndensity = 1\n");
    EXPECT_NE(layer.find("the name of a box (tuft)"), std::string::npos) << layer;
}

TEST_F(SceneFile, includedMaterialsAndBoxesCanBeUsedAndReplaced)
{
    const fs::path other = fs::path(testing::TempDir()) / "scene_included.toml";
    const std::string level = "[[box.X.level]]\nlength = 1\nradius = 0.1\n";
    const auto box = [&](const std::string& name, const std::string& more) {
        std::string text = "[box.X]\nmaterial = \"fur\"\n" + more + level;
        for (std::size_t at; (at = text.find('X')) != std::string::npos;) text.replace(at, 1, name);
        return text;
    };
    std::ofstream(other) << kMaterial << "n = 1.3\n" << box("a", "") << box("b", "variants = 7\n");
    EXPECT_EQ(
        messageOf("include = \"scene_included.toml\"\n[material.fur]\nkind = \"fibre\"\nn = 2\n"
                  + box("a", "variants = 9\n")),
        "no error");
    const Scene scene = readScene(m_file);
    ASSERT_EQ(scene.materials.size(), 1u);
    EXPECT_EQ(scene.materials[0].n, 2);
    ASSERT_EQ(scene.boxes.size(), 2u);
    EXPECT_EQ(scene.boxes[0].name, "b");
    EXPECT_EQ(scene.boxes[0].variants, 7);
    EXPECT_EQ(scene.boxes[1].variants, 9);
    std::ofstream(other) << "include = \"scene_included.toml\"\n";
    EXPECT_NE(messageOf("include = \"scene_included.toml\"\n").find("do not include each other"),
              std::string::npos);
    fs::remove(other);
    EXPECT_NE(messageOf("include = \"none.toml\"\n")
                  .find(".toml:1: include: expected files relative to this one"),
              std::string::npos);
}

constexpr const char* kTuft =
    "[box.tuft]\nmaterial = \"fur\"\n[[box.tuft.level]]\nlength = 1\nradius = 0.1\n";

TEST_F(SceneFile, includesMayMeetAgainAndBeLong)
{
    const TemporaryFolder folder;
    const auto include = [](const std::string& names) { return "include = [" + names + "]\n"; };
    // a includes b and c, which both include d.
    folder.write("d.toml", std::string(kMaterial) + kTuft);
    folder.write("b.toml", include("'d.toml', './d.toml'"));
    folder.write("c.toml", include("'../" + folder.path().filename().string() + "/d.toml'"));
    Scene scene = readScene(folder.write("a.toml", include("'b.toml', 'c.toml'")));
    EXPECT_EQ(scene.boxes.size(), 1u);
    EXPECT_EQ(scene.scene_files,
              (std::vector<fs::path>{folder / "d.toml", folder / "b.toml", folder / "c.toml",
                                     folder / "a.toml"}));
    // Each of 40 files includes the next one twice: 2^40 ways lead to the last one.
    folder.write("way40.toml", std::string(kMaterial) + kTuft);
    for (int i = 0; i < 40; ++i) {
        const std::string next = "'way" + std::to_string(i + 1) + ".toml'";
        folder.write("way" + std::to_string(i) + ".toml", include(next + ", " + next));
    }
    EXPECT_EQ(readScene(folder / "way0.toml").materials.size(), 1u);
    // 1000 files in a row, each with a material of its own.
    for (int i = 0; i < 1000; ++i)
        folder.write("row" + std::to_string(i) + ".toml",
                     include(i == 0 ? "" : "'row" + std::to_string(i - 1) + ".toml'")
                         + "[material.m" + std::to_string(i) + "]\n");
    scene = readScene(folder / "row999.toml");
    ASSERT_EQ(scene.materials.size(), 1000u);
    EXPECT_EQ(scene.materials.front().name, "m999");
    EXPECT_EQ(scene.materials.back().name, "m0");
    // One file, ten thousand times; and more than there may be.
    std::string names;
    for (int i = 0; i < 10000; ++i) names += "'d.toml', ";
    EXPECT_EQ(readScene(folder.write("many.toml", include(names))).scene_files.size(), 2u);
    for (int i = 0; i < 4; ++i) names += names;
    EXPECT_NE(volcomp::messageOf([&] {
                  readScene(folder.write("more.toml", include(names)));
              }).find("more.toml:1: include: expected at most 100000 includes"),
              std::string::npos);
}

TEST_F(SceneFile, filesThatIncludeEachOtherAreNamed)
{
    const TemporaryFolder folder;
    const auto expectCircle = [&](const std::string& names) {
        const std::string message = volcomp::messageOf([&] { readScene(folder / "a.toml"); });
        EXPECT_NE(message.find(names), std::string::npos) << message;
    };
    const std::string a = (folder / "a.toml").string(), b = (folder / "b.toml").string(),
                      c = (folder / "c.toml").string();
    folder.write("a.toml", "include = 'a.toml'\n");
    expectCircle("do not include each other (" + a + " includes " + a + ")");
    folder.write("a.toml", "include = 'b.toml'\n");
    folder.write("b.toml", "\ninclude = 'c.toml'\n");
    folder.write("c.toml", "include = 'b.toml'\n");
    expectCircle(c + ":1: include: expected files that do not include each other (" + b
                 + " includes " + c + " includes " + b + ")");
}

TEST_F(SceneFile, namesThatBreakFilesOrChannelsAreRefused)
{
    const std::string level = "[[box.tuft.level]]\nlength = 1\nradius = 0.1\nname = ",
                      surface = "[surface.s]\nmesh = 'a.obj'\n",
                      layer = kMaterial + std::string(kTuft) + surface
        + "[[layer]]\nbox = 'tuft'\ndensity = 1\nname = ";
    for (const std::string name :
         {"\"\"", "\"a\\nb\"", "\"a/b\"", "\"..\"", "\"a:b\"", "\" a\"", "\"\\u007f\""}) {
        for (const std::string& text :
             {"[material." + name + "]\n", kMaterial + std::string("[box.") + name + "]\n",
              "[surface." + name + "]\nmesh = 'a.obj'\n", layer + name, "[[light]]\nname = " + name,
              kMaterial + std::string("[box.tuft]\nmaterial = 'fur'\n") + level + name})
            EXPECT_NE(messageOf(text).find("a name of letters, digits, '_' and '-'"),
                      std::string::npos)
                << text << "\n"
                << messageOf(text);
    }
    EXPECT_EQ(messageOf(layer + "\"rote T\xc3\xbclpen 2\"\n"), "no error");
    for (const char* name : {"R", "A", "Z", "N", "albedo", "ambient", "background", "haze"})
        EXPECT_NE(messageOf("[[light]]\n[[light]]\nname = '" + std::string(name) + "'\n")
                      .find(":3: light.name: expected a name that no channel of the picture has"),
                  std::string::npos)
            << name;
    EXPECT_NE(messageOf("[[light]]\nname = 'light2'\n[[light]]\n").find("no other light has"),
              std::string::npos);
    EXPECT_NE(messageOf(layer + "'a'\n[[layer]]\nbox = 'tuft'\ndensity = 1\nname = 'a'\n")
                  .find("a name that no other layer has"),
              std::string::npos);
    EXPECT_NE(messageOf("[material.a]\n[material.b]\n[material.a]\n").find(":3:"),
              std::string::npos);
}

TEST_F(SceneFile, valuesThatTheLibraryRefusesAreShownWithTheirPlace)
{
    // Each key is in its range; together they grow more than the limit.
    EXPECT_NE(messageOf(kMaterial + std::string(kTuft) + "count = 1e9\nsegments = 10000\n")
                  .find(".toml:3: [box.tuft]: box tuft:"),
              std::string::npos);
    for (const char* seed : {"9007199254740993", "9223372036854775807"})
        EXPECT_EQ(messageOf(kMaterial + std::string("[box.tuft]\nmaterial = \"fur\"\nseed = ")
                            + seed + "\n[[box.tuft.level]]\nlength = 1\nradius = 0.1\n"),
                  "no error");
    EXPECT_EQ(readScene(m_file).boxes.at(0).seed, 9223372036854775807u);
    std::string levels;
    for (int i = 0; i < 1001; ++i) levels += "[[box.tuft.level]]\nlength = 1\nradius = 0.1\n";
    EXPECT_NE(messageOf(kMaterial + std::string("[box.tuft]\nmaterial = \"fur\"\n") + levels)
                  .find("at most 1000 levels"),
              std::string::npos);
}

TEST_F(SceneFile, aLevelThatSeemsToBelongOnTheGroundWarns)
{
    const auto warningsOf = [&](const std::string& second) {
        EXPECT_EQ(messageOf(kMaterial + std::string(kTuft)
                            + "[[box.tuft.level]]\nlength = 1\nradius = 0.1\n" + second),
                  "no error");
        return readScene(m_file).warnings;
    };
    for (const std::string key : {"spread = 0.1", "clump = 0.5", "clumps = 3"}) {
        const std::vector<std::string> warnings = warningsOf(key + "\n");
        ASSERT_EQ(warnings.size(), 1u);
        EXPECT_NE(warnings[0].find(".toml:8: [box.tuft.level]: level 'level2' grows on 'level1'"),
                  std::string::npos)
            << warnings[0];
        EXPECT_NE(warnings[0].find("parent = \"ground\""), std::string::npos);
        EXPECT_TRUE(warningsOf(key + "\nparent = \"ground\"\n").empty());
        EXPECT_TRUE(warningsOf(key + "\nparent = \"level1\"\n").empty());
    }
    EXPECT_TRUE(warningsOf("count = 9\n").empty());
}

TEST_F(SceneFile, hazeThatHidesTheDomeWarns)
{
    const std::string dome = "[dome]\ncolour = [1, 1, 1]\n";
    const auto warningsOf = [&](const std::string& text) {
        EXPECT_EQ(messageOf(text), "no error");
        return readScene(m_file).warnings;
    };
    const std::vector<std::string> warnings = warningsOf(dome + "[haze]\ndensity = 0.01\n");
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_NE(warnings[0].find(".toml:3: [haze]: without a height"), std::string::npos)
        << warnings[0];
    EXPECT_TRUE(warningsOf(dome + "[haze]\ndensity = 0.01\nheight = 30\n").empty());
    EXPECT_TRUE(warningsOf(dome + "visible = false\n[haze]\ndensity = 0.01\n").empty());
    EXPECT_TRUE(warningsOf(dome + "[haze]\nheight = 0\n").empty());
    EXPECT_TRUE(warningsOf("[haze]\ndensity = 0.01\n").empty());
}

TEST(Scenes, ourOwnWarnOfNothing)
{
    int count = 0;
    for (const auto& entry : fs::recursive_directory_iterator(VOLCOMP_SOURCE "/scenes")) {
        if (entry.path().extension() != ".toml") continue;
        ++count;
        const Scene scene = readScene(entry.path());
        EXPECT_TRUE(scene.warnings.empty()) << scene.warnings[0];
    }
    EXPECT_GT(count, 10);
}

TEST_F(SceneFile, everyFileThatItNamesIsKnown)
{
    const TemporaryFolder folder;
    folder.write("boxes.toml", std::string(kMaterial) + kTuft + "# 'no.obj'\n");
    const Scene scene = readScene(folder.write("a.toml", R"(
include = 'boxes.toml'
[material.wall]
kind = "surface"
[surface.mesh]
mesh = "a.obj"
skin = "wall"
skin_map = [{image = 'skin.png'}, {noise = 0.1}]
[surface.ground]
ground = [1, 1]
height_map = "height.png"
[[layer]]
name = "no"
surface = "mesh"
box = "tuft"
density = 1
comb_map = "comb.png"
where = [{image = "where.png"}, {image = "skin.png"}]
size_map = [{image = "size.png"}]
colour = [{image = "maps/colour.png"}]
[dome]
kind = "image"
image = "sky.exr"
)"));
    std::vector<fs::path> expected;
    for (const char* name : {"a.obj", "a.toml", "boxes.toml", "comb.png", "height.png",
                             "maps/colour.png", "size.png", "skin.png", "sky.exr", "where.png"})
        expected.push_back(folder.path() / name);
    EXPECT_EQ(usedFiles(scene), expected);
    EXPECT_NE(scene.surfaces.at(0).source.find("ground = [1, 1]\nheight_map = \"height.png\"\n"),
              std::string::npos);
    EXPECT_NE(scene.layers.at(0).source.find("where.1.image = \"where.png\"\n"), std::string::npos);
    const std::string& box = scene.boxes.at(0).source;
    for (const char* line : {"material = \"fur\"\n", "\nlevel.1.length = 1\n",
                             "\nlevel.1.radius = 0.1\n", "\nlevel.1.curl_turns = 3\n"})
        EXPECT_NE(box.find(line), std::string::npos) << line;
}

TEST_F(SceneFile, onlyADomeOfKindImageHasOne)
{
    std::string message = messageOf("[dome]\nkind = \"image\"\n");
    EXPECT_NE(message.find("the path of an image"), std::string::npos) << message;
    message = messageOf("[dome]\nimage = \"sky.exr\"\n");
    EXPECT_NE(message.find("dome.image: expected no image, or kind = \"image\""), std::string::npos)
        << message;
}

TEST_F(SceneFile, unknownTablesAreRefused)
{
    const std::string message = messageOf("[materiel.fur]\nkind = \"fibre\"\n");
    EXPECT_NE(message.find("did you mean 'material'"), std::string::npos) << message;
}

TEST_F(SceneFile, twoLayersOrLightsOfOneNameAreRefused)
{
    const std::string message = messageOf("[[light]]\nname = \"key\"\n[[light]]\nname = \"key\"\n");
    EXPECT_NE(message.find("a name that no other light has"), std::string::npos) << message;
}

TEST(SceneKeys, theScenePageListsExactlyTheKeysThatTheParserKnows)
{
    std::ifstream stream(VOLCOMP_SOURCE "/scenes/README.md");
    std::stringstream page;
    page << stream.rdbuf();
    const std::string begin = "<!-- keys: made by volcomp-bake --scene-keys -->\n",
                      end = "<!-- end of keys -->";
    const auto from = page.str().find(begin), to = page.str().find(end);
    ASSERT_TRUE(from != std::string::npos && to != std::string::npos)
        << "scenes/README.md lacks the marks around its list of keys";
    std::stringstream written(page.str().substr(from + begin.size(), to - from - begin.size())),
        parsed(keysAsMarkdown(sceneKeys()));
    for (std::string a, b; std::getline(parsed, a);) {
        std::getline(written, b);
        ASSERT_EQ(a, b)
            << "run scenes/update_keys.sh, which puts the output of `volcomp-bake --scene-keys` into scenes/README.md";
    }
    std::string rest;
    EXPECT_FALSE(std::getline(written, rest)) << rest;
}

TEST(SceneKeys, everyKeySaysWhatItMeans)
{
    for (const KeyDoc& key : sceneKeys())
        EXPECT_FALSE(key.meaning.empty()) << key.table << "." << key.key;
}

} // namespace
} // namespace volcomp
