#include "scene.h"

#include <fstream>
#include <functional>
#include <sstream>

#include <gtest/gtest.h>

#include "error.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;

class SceneFile : public testing::Test {
protected:
    std::string messageOf(const std::string& text)
    {
        m_file = fs::path(testing::TempDir()) / (std::string("scene_") + testing::UnitTest::GetInstance()->current_test_info()->name() + ".toml");
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
    const std::string layer = messageOf(std::string(kMaterial) + "[box.tuft]\nmaterial = \"fur\"\nlevel = [{}]\n[surface.a]\nmesh = \"a.obj\"\n[[layer]]\nbox = \"tuf\"\n");
    EXPECT_NE(layer.find("the name of a box (tuft)"), std::string::npos) << layer;
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
    const std::string begin = "<!-- keys: made by volcomp-bake --scene-keys -->\n", end = "<!-- end of keys -->";
    const auto from = page.str().find(begin), to = page.str().find(end);
    ASSERT_TRUE(from != std::string::npos && to != std::string::npos) << "scenes/README.md lacks the marks around its list of keys";
    EXPECT_EQ(page.str().substr(from + begin.size(), to - from - begin.size()), keysAsMarkdown(sceneKeys()))
        << "put the output of `volcomp-bake --scene-keys` between the marks in scenes/README.md";
}

TEST(SceneKeys, everyKeySaysWhatItMeans)
{
    for (const KeyDoc& key : sceneKeys()) EXPECT_FALSE(key.meaning.empty()) << key.table << "." << key.key;
}

} // namespace
} // namespace volcomp
