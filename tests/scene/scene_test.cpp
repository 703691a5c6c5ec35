// SPDX-License-Identifier: Apache-2.0
#include "volcomp/scene/scene.h"

#include <fstream>
#include <functional>
#include <sstream>

#include <gtest/gtest.h>

#include "volcomp/base/error.h"

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
