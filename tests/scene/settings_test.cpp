// SPDX-License-Identifier: Apache-2.0
// Settings beside a scene file, and what files take over from each other.
#include <functional>

#include <gtest/gtest.h>

#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"
#include "volcomp/scene/scene.h"
#include "volcomp/scene/scene_recipe.h"

namespace volcomp {
namespace {

constexpr const char* kScene = R"(
[material.fur]
kind = "fibre"
[box.tuft]
material = "fur"
[[box.tuft.level]]
name = "guard"
length = 0.2
[[box.tuft.level]]
parent = "ground"
length = 0.1
[[light]]
strength = [3, 3, 3]
[[light]]
name = "rim light"
[camera]
eye = [0, 1, 2]
)";

class Settings : public testing::Test {
protected:
    void SetUp() override { write("scene.toml", kScene); }
    std::filesystem::path write(const std::string& name, const std::string& text)
    {
        std::filesystem::create_directories(path(name).parent_path());
        return m_folder.write(name, text);
    }
    Scene scene(const std::vector<std::string>& settings, const std::string& name = "scene.toml")
    {
        return readScene(m_folder / name, settings);
    }
    std::string message(const std::string& setting)
    {
        return messageOf([&] { scene({setting}); });
    }
    std::filesystem::path path(const std::string& name) const { return m_folder / name; }

private:
    TemporaryFolder m_folder;
};

TEST_F(Settings, countAsIfTheFileSaidThem)
{
    const Scene s = scene({"light.rim light.strength=2", "light.light1.strength=#ff0000",
                           "light.2.disc_degrees=3", "box.tuft.level.guard.length=0.25",
                           "box.tuft.level.2.length = 0.15", "camera.eye=[1, 2, 3]",
                           "render.shadows=exact", "render={samples=7}", "compose.voxel=0.01"});
    EXPECT_EQ(s.lights[1].strength, Vec3d(2));
    EXPECT_EQ(s.lights[0].strength, Vec3d(1, 0, 0));
    EXPECT_NEAR(s.lights[1].disc, 3 * kDegree, 1e-12);
    EXPECT_EQ(s.boxes[0].levels[0].length, 0.25);
    EXPECT_EQ(s.boxes[0].levels[1].length, 0.15);
    EXPECT_EQ(s.camera.eye, Vec3d(1, 2, 3));
    EXPECT_EQ(s.render.shadows, Shadows::exact);
    EXPECT_EQ(s.render.samples, 7);
    EXPECT_EQ(s.compose.voxel, 0.01);
    EXPECT_EQ(scene({"render.samples=3", "render.samples=4"}).render.samples, 4) << "the last wins";
}

TEST_F(Settings, enterRecipes)
{
    const auto recipe = [&](const std::vector<std::string>& settings) {
        const Scene s = scene(settings);
        return boxRecipe(s, s.boxes[0]).text();
    };
    const std::string plain = recipe({});
    EXPECT_EQ(recipe({"box.tuft.level.1.length=0.2"}), plain);
    EXPECT_NE(recipe({"box.tuft.level.1.length=0.3"}), plain);
    EXPECT_EQ(recipe({"light.1.strength=9"}), plain);
}

TEST_F(Settings, thatAreWrongAreShownWithTheirPlace)
{
    for (
        const auto& [setting, parts] :
        std::vector<std::pair<std::string, std::vector<std::string>>>{
            {"render.sampels=4",
             {"--set render.sampels=4: unknown key 'render.sampels'; did you mean 'samples'?",
              "1 | render.sampels=4", "^~~~~~~"}},
            {"render.samples=many",
             {"--set render.samples=many: render.samples: expected a whole number",
              "found \"many\""}},
            {"render.shadows=swept", {"did you mean \"sweep\"?"}},
            {"ligth.1.strength=2", {"unknown key 'ligth'; did you mean 'light'?"}},
            {"light.rim lihgt.strength=2",
             {"expected the name of a [[light]] or its number (light1, rim light), found 'rim lihgt'",
              "did you mean 'rim light'?"}},
            {"light.1=2", {"expected a key of [[light]] after the name"}},
            {"light.1.strength=-1", {"light.strength: expected a colour", "found -1"}},
            {"box.tuft.level.3.length=1", {"[[level]] or its number (guard, level2)"}},
            {"camera.eye.x=1", {"camera.eye: expected three numbers", "found a table"}},
            {"material.fur.kind=wool", {"--set material.fur.kind=wool", "fibre"}},
            {"include=a.toml", {"'include', which only a file can say"}},
            {"render.samples", {"expected KEY=VALUE", "found no ="}},
            {"=4", {"found no key"}},
            {"render.samples=", {"render.samples: expected a whole number"}},
            {"[render]=4", {"found a bracket first"}},
            {"a..b=1", {"--set a..b=1"}},
            {std::string("a=") + std::string(40, '['), {"--set a="}}}) {
        const std::string said = message(setting);
        for (const std::string& part : parts)
            EXPECT_NE(said.find(part), std::string::npos) << part << " is not in:\n" << said;
    }
}

TEST_F(Settings, changeTheIncludedFileWhoseTableCounts)
{
    write("inner.toml", "[material.fur]\nkind = 'fibre'\nalpha = 0.1\n");
    write("a.toml", "[material.fur]\nkind = 'fibre'\nalpha = 0.2\n[[light]]\nname = 'key'\n");
    write("b.toml", "include = 'inner.toml'\n[material.leaf]\nkind = 'surface'\n");
    write("all.toml", "include = ['b.toml', 'a.toml']\n[material.own]\nkind = 'fibre'\n");
    const Scene s = scene(
        {"material.fur.alpha=0.7", "material.leaf.alpha=0.6", "light.key.strength=5"}, "all.toml");
    const auto alpha = [&](const std::string& name) {
        for (const Material& m : s.materials)
            if (m.name == name) return m.alpha;
        return -1.0;
    };
    EXPECT_EQ(alpha("fur"), 0.7); // b.toml, which comes first, has it from inner.toml
    EXPECT_EQ(alpha("leaf"), 0.6);
    EXPECT_EQ(s.lights.at(0).strength, Vec3d(5));
}

TEST_F(Settings, includedFilesGiveWhatIsLeftOut)
{
    write(
        "sky/look.toml",
        "[render]\nsamples = 9\nwidth = 100\n[camera]\neye = [5, 5, 5]\nfield_of_view_degrees = 20\n"
        "[compose]\nvoxel = 0.5\n[picture]\ntone = 'filmic'\n[haze]\ndensity = 0.1\nheight = 2\n"
        "[dome]\nkind = 'image'\nimage = 'sky.hdr'\n[[light]]\nname = 'sun'\nstrength = 4\n"
        "[[light]]\nname = 'rim'\nstrength = 4\n");
    write("middle.toml", "include = 'sky/look.toml'\n[render]\nsamples = 8\n");
    write("own.toml",
          "include = 'middle.toml'\n[render]\nwidth = 64\n[camera]\neye = [1, 1, 1]\n"
          "[[light]]\nname = 'rim'\nstrength = 1\n");
    const Scene s = scene({}, "own.toml");
    EXPECT_EQ(s.render.width, 64);
    EXPECT_EQ(s.render.samples, 8);
    EXPECT_EQ(s.camera.eye, Vec3d(1));
    EXPECT_NEAR(s.camera.field_of_view, 20 * kDegree, 1e-12);
    EXPECT_EQ(s.compose.voxel, 0.5);
    EXPECT_EQ(s.look.tone, Tone::filmic);
    EXPECT_EQ(s.render.haze.density, 0.1);
    EXPECT_EQ(s.render.dome.file, path("sky/sky.hdr"));
    ASSERT_EQ(s.lights.size(), 2u);
    EXPECT_EQ(s.lights[0].name, "rim");
    EXPECT_EQ(s.lights[0].strength, Vec3d(1));
    EXPECT_EQ(s.lights[1].name, "sun");
    // A dome comes whole or not at all.
    write("own.toml", "include = 'middle.toml'\n[dome]\nkind = 'constant'\n");
    EXPECT_EQ(scene({}, "own.toml").render.dome.file, "");
    // What is wrong is shown in the file that says it.
    write("sky/look.toml", "[camera]\nup = [1, 0, 0]\n");
    write("own.toml", "include = 'middle.toml'\n[camera]\neye = [1, 0, 0]\n");
    const std::string said = messageOf([&] { scene({}, "own.toml"); });
    EXPECT_NE(said.find("target"), std::string::npos) << said;
}

TEST_F(Settings, levelsUsePresets)
{
    write("needles.toml",
          "[preset.needle]\nlength = 0.02\nradius = 0.001\ncolour_root = [0.1, 0.3, 0.1]\n");
    const std::string use =
        "[material.fur]\nkind = 'fibre'\n[box.tuft]\nmaterial = 'fur'\n[[box.tuft.level]]\n";
    write("own.toml", "include = 'needles.toml'\n" + use + "use = 'needle'\nlength = 0.03\n");
    const Scene s = scene({}, "own.toml");
    const GrowthLevel& level = s.boxes.at(0).levels.at(0);
    EXPECT_EQ(level.length, 0.03);
    EXPECT_EQ(level.radius, 0.001);
    EXPECT_EQ(level.colour_tip, Vec3d(0.1, 0.3, 0.1)) << "as without a preset, that of the root";
    // What is written out makes the same recipe.
    write("out.toml", use + "length = 0.03\nradius = 0.001\ncolour_root = [0.1, 0.3, 0.1]\n");
    const Scene written = scene({}, "out.toml");
    EXPECT_EQ(boxRecipe(s, s.boxes[0]).text(), boxRecipe(written, written.boxes[0]).text());
    EXPECT_EQ(scene({"preset.needle.radius=0.002"}, "own.toml").boxes[0].levels[0].radius, 0.002);

    const auto said = [&] { return messageOf([&] { scene({}, "own.toml"); }); };
    write("needles.toml", "[preset.needle]\nlenght = 0.02\n");
    EXPECT_NE(
        said().find("needles.toml:2: unknown key 'box.tuft.level.lenght'; did you mean 'length'?"),
        std::string::npos)
        << said();
    write("needles.toml", "[preset.needle]\nuse = 'other'\n");
    EXPECT_NE(said().find("needles.toml:2: "), std::string::npos) << said();
    write("needles.toml", "[preset.needles]\nlength = 0.02\n");
    EXPECT_NE(
        said().find("own.toml:7: box.tuft.level.use: expected a name that there is (did you mean "
                    "'needles'?)"),
        std::string::npos)
        << said();
}

} // namespace
} // namespace volcomp
