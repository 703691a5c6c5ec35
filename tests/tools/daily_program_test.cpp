// SPDX-License-Identifier: Apache-2.0
// volcomp does what is out of date, says why, and does nothing else.
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <regex>
#include <thread>

#include <openvdb/openvdb.h>

#include "tests/tools/programs.h"
#include "volcomp/view/image.h"
#include "volcomp/volume/vdb_io.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;

class Daily : public Programs {
protected:
    /// The stages of a run by their names, as its statistics have them.
    std::vector<std::string> stages(const std::string& more = "")
    {
        fs::remove(path("stats.json"));
        const Outcome outcome = volcomp("scene.toml --stats stats.json " + more);
        EXPECT_EQ(outcome.status, 0) << outcome.output;
        m_said = outcome.output;
        std::vector<std::string> names;
        const nlohmann::json stats = readJson("stats.json");
        for (const auto& stage : stats.value("stages", nlohmann::json::array()))
            names.push_back(stage["name"]);
        return names;
    }
    const std::string& said() const { return m_said; }
    bool has(const std::vector<std::string>& names, const std::string& name) const
    {
        return std::find(names.begin(), names.end(), name) != names.end();
    }
    void expectSaid(const std::string& text) const
    {
        EXPECT_NE(m_said.find(text), std::string::npos) << "'" << text << "' is not in: " << m_said;
    }

private:
    std::string m_said;
};

TEST_F(Daily, MakesAPictureAndThenNothing)
{
    const auto first = stages();
    EXPECT_TRUE(has(first, "bake tuft") && has(first, "place") && has(first, "render"));
    expectSaid("bake tuft (2 of 2): there is no tuft_1.vdb");
    EXPECT_TRUE(exists("out/scene/scene.exr") && exists("out/scene/scene.png"));
    EXPECT_FALSE(exists("out/scene/volume.vdb"));
    const auto written = fs::last_write_time(path("out/scene/scene.png"));
    EXPECT_TRUE(stages().empty()) << said();
    expectSaid("out/scene/scene.png is up to date: nothing to do");
    EXPECT_EQ(fs::last_write_time(path("out/scene/scene.png")), written);
}

TEST_F(Daily, MakesTheBoxesAndPixelsOfTheOtherPrograms)
{
    ASSERT_EQ(bake().status, 0);
    const Outcome rendered = run("render", "scene.toml --boxes boxes -o a.exr");
    ASSERT_EQ(rendered.status, 0) << rendered.output;
    stages();
    for (const std::string box : {"boxes/tuft_1.vdb", "boxes/tuft_2.vdb"})
        EXPECT_TRUE(readBody(box) == readBody("out/scene/" + box)) << box;
    EXPECT_EQ(readImage(path("a.exr")).pixels, readImage(path("out/scene/scene.exr")).pixels);
}

TEST_F(Daily, ALightAndACameraOnlyRender)
{
    stages();
    for (const auto& [from, to, why] :
         {std::tuple("direction = [-1", "direction = [-1, -2, -2]", "light.light1.direction was ["),
          std::tuple("eye =", "eye = [0, 1.5, 2.5]", "camera.eye was [0.0,1.5,2.0] and is"),
          std::tuple("target =", "target = [0, 0, 0]\nfield_of_view_degrees = 30",
                     "camera.field_of_view_degrees was 40.0 and is 30.0 now")}) {
        writeSceneWith(from, to);
        const auto done = stages();
        EXPECT_TRUE(has(done, "render") && !has(done, "bake tuft")) << said();
        expectSaid(why);
    }
}

TEST_F(Daily, BakesTheBoxThatHasChangedAndItsNewVariantsAlone)
{
    write("scene.toml",
          std::string(kScene)
              + "[[layer]]\nname = \"more\"\nbox = \"blade\"\ndensity = 5\n[box.blade]\nmaterial = "
                "\"fur\"\nvoxel = 0.01\n[[box.blade.level]]\ncount = 1\nlength = 0.1\nradius = "
                "0.004\n");
    EXPECT_TRUE(has(stages(), "bake blade"));
    const std::string scene = read("scene.toml");
    write("scene.toml", std::regex_replace(scene, std::regex("length = 0.1"), "length = 0.15"));
    const auto done = stages();
    EXPECT_TRUE(has(done, "bake blade") && !has(done, "bake tuft")) << said();
    expectSaid("bake blade (4 of 4): box.blade.level.1.length was 0.1 and is 0.15 now");
    expectSaid("render: box.blade has changed");
    write("scene.toml",
          std::regex_replace(read("scene.toml"), std::regex("variants = 2"), "variants = 3"));
    stages();
    expectSaid("bake tuft (1 of 3): there is no tuft_3.vdb");
}

TEST_F(Daily, RendersAgainWhenAMapOrTheOutputHasChanged)
{
    stages();
    write("where.pgm", "P2\n2 1\n255\n128 128\n");
    auto done = stages();
    EXPECT_TRUE(has(done, "render") && !has(done, "bake tuft"));
    expectSaid("render: layer.fur.where content has changed");
    EXPECT_TRUE(has(stages("--size 24x16"), "render"));
    expectSaid("render.width was 48 and is 24 now");
    EXPECT_TRUE(stages("--size 24x16").empty()) << said();
    write("out/scene/scene.png", "not a picture");
    EXPECT_TRUE(has(stages("--size 24x16"), "render"));
    expectSaid("scene.png was written by something else since");
    EXPECT_TRUE(has(stages("--size 24x16 --again"), "bake tuft"));
}

TEST_F(Daily, ComposesAFileThatIsOutOfDate)
{
    auto done = stages("--volume");
    EXPECT_TRUE(has(done, "compose") && has(done, "load") && has(done, "render"));
    EXPECT_TRUE(stages("--volume").empty()) << said();
    writeSceneWith("direction = [-1", "direction = [-1, -2, -2]");
    done = stages("--volume");
    EXPECT_TRUE(has(done, "render") && !has(done, "compose")) << said();
    writeSceneWith("voxel = 0.02", "voxel = 0.03");
    done = stages("--until compose");
    EXPECT_TRUE(has(done, "compose") && !has(done, "render")) << said();
    expectSaid("compose.voxel was 0.02 and is 0.03 now");
    EXPECT_TRUE(stages("--until compose").empty()) << said();
    // Without a voxel in the scene it follows from the camera and the picture's size.
    writeSceneWith("voxel = 0.02", "voxel_pixels = 1");
    stages("--until compose");
    EXPECT_TRUE(stages("--until compose").empty()) << said();
    EXPECT_TRUE(has(stages("--until compose --size 24x16"), "compose"));
}

TEST_F(Daily, SaysWhatItWouldDoAndDoesNothing)
{
    EXPECT_TRUE(stages("--dry-run").empty());
    expectSaid("bake tuft (2 of 2)");
    expectSaid("render: there is no scene.exr");
    EXPECT_FALSE(exists("out"));
    const auto done = stages("--until bake");
    EXPECT_EQ(done, std::vector<std::string>{"bake tuft"});
    EXPECT_TRUE(has(stages("--until place"), "place"));
    expectSaid("layer 'fur': ");
}

TEST_F(Daily, LeavesBoxesOfOtherProgramsAsTheyAre)
{
    openvdb::initialize();
    stages("--until bake");
    const fs::path box = path("out/scene/boxes/tuft_1.vdb"),
                   other = path("out/scene/boxes/tuft_2.vdb");
    writeVolume(box, readVolume(other), {});
    const std::string bytes = read("out/scene/boxes/tuft_1.vdb");
    writeSceneWith("length = 0.2", "length = 0.25");
    stages();
    expectSaid("bake tuft (1 of 2): box.tuft.level.1.length was 0.2 and is 0.25 now");
    EXPECT_EQ(read("out/scene/boxes/tuft_1.vdb"), bytes);
    EXPECT_TRUE(stages().empty()) << said();
    writeVolume(box, readVolume(other), {});
    stages();
    expectSaid("render: tuft_1.vdb content has changed");
}

TEST_F(Daily, TagsAndNumbersPictures)
{
    stages("--tag warm");
    EXPECT_TRUE(exists("out/scene/scene.warm.exr") && !exists("out/scene/scene.exr"));
    stages("--tag v##");
    EXPECT_TRUE(stages("--tag v##").empty()) << said(); // v01 is that picture
    writeSceneWith("direction = [-1", "direction = [-1, -2, -2]");
    stages("--tag v##");
    EXPECT_TRUE(exists("out/scene/scene.v01.png") && exists("out/scene/scene.v02.png"));
    expectFailure(volcomp("scene.toml --tag a/b"), {"--tag", "'a/b'"}, "out/scene/scene.a");
}

TEST_F(Daily, RefusesAFolderWhoseFilesTheSceneReads)
{
    fs::create_directories(path("out/scene"));
    fs::rename(path("ground.obj"), path("out/scene/scene.png"));
    writeSceneWith("mesh =", "mesh = \"out/scene/scene.png\"");
    EXPECT_EQ(volcomp("scene.toml --until bake").status, 0);
    const Outcome outcome = volcomp("scene.toml");
    EXPECT_EQ(outcome.status, 1) << outcome.output;
    EXPECT_EQ(read("out/scene/scene.png"), kMesh);
}

TEST_F(Daily, SettingsCountInEveryProgram)
{
    stages();
    const auto done =
        stages("--set light.light1.strength=2 --set \"box.tuft.level.1.length=0.25\"");
    EXPECT_TRUE(has(done, "bake tuft")) << said();
    expectSaid("box.tuft.level.1.length was 0.2 and is 0.25 now");
    expectSaid("light.light1.strength was [1.0,1.0,1.0] and is [2.0,2.0,2.0] now");
    EXPECT_TRUE(stages("--set light.1.strength=2 --set box.tuft.level.1.length=0.25").empty());

    const Outcome baked = run("bake", "scene.toml -o boxes --set box.tuft.level.1.length=0.25");
    ASSERT_EQ(baked.status, 0) << baked.output;
    EXPECT_TRUE(readBody("boxes/tuft_1.vdb") == readBody("out/scene/boxes/tuft_1.vdb"));
    expectFailure(run("compose", "scene.toml --boxes boxes -o volume.vdb"),
                  {"box.tuft.level.1.length was 0.25 and is 0.2 now"}, "volume.vdb");
    const std::string more = "--set box.tuft.level.1.length=0.25 --set light.1.strength=2";
    EXPECT_EQ(run("compose", "scene.toml --boxes boxes -o volume.vdb " + more).status, 0);
    EXPECT_EQ(run("render", "scene.toml --boxes boxes -o a.exr " + more).status, 0);
    EXPECT_EQ(readImage(path("a.exr")).pixels, readImage(path("out/scene/scene.exr")).pixels);
    for (const char* program : {"render", "truth"})
        expectFailure(run(program, "scene.toml -o b.exr --set render.sampels=4"),
                      {"--set render.sampels=4: unknown key", "did you mean 'samples'?"}, "b.exr");
}

TEST_F(Daily, ComparesPictures)
{
    stages("--tag a");
    stages("--tag b --set light.1.strength=[2,2,2]");
    const Outcome outcome = volcomp("compare out/scene/scene.b.exr out/scene/scene.a.exr -o d.png "
                                    "--stats compared.json");
    ASSERT_EQ(outcome.status, 0) << outcome.output;
    EXPECT_NE(outcome.output.find("bias           +100 %"), std::string::npos) << outcome.output;
    const nlohmann::json difference = readJson("compared.json")["difference"];
    EXPECT_NEAR(difference["bias"], 1, 1e-5);
    EXPECT_EQ(difference["alpha_rmse"], 0);
    EXPECT_GT(difference["worst"].size(), 0u);
    EXPECT_GT(readImage(path("d.png")).width, 3 * 48);
    const Outcome same = volcomp("compare out/scene/scene.a.png out/scene/scene.a.png");
    EXPECT_NE(same.output.find("the pictures are equal"), std::string::npos) << same.output;
    expectFailure(volcomp("compare out/scene/scene.a.png out/scene/scene.a.exr -o e.png"),
                  {"two pictures of one kind"}, "e.png");
    expectFailure(volcomp("compare none.exr out/scene/scene.a.exr -o e.png"), {"none.exr"},
                  "e.png");
    EXPECT_EQ(volcomp("compare out/scene/scene.a.exr").status, 2);
}

TEST_F(Daily, DrawsALayoutWithoutBaking)
{
    const auto done = stages("--layout");
    EXPECT_TRUE(has(done, "layout") && !has(done, "bake tuft"));
    const Image layout = readImage(path("out/scene/scene.layout.png"));
    EXPECT_GT(layout.width, 48) << "there is a margin around the frame";
    EXPECT_TRUE(exists("out/scene/scene.maps.png"));
    EXPECT_FALSE(exists("out/scene/boxes/tuft_1.vdb"));
    stages("--layout --camera 0,3,4,0,0,0,20");
    EXPECT_NE(readImage(path("out/scene/scene.layout.png")).pixels, layout.pixels);
    expectFailure(volcomp("scene.toml --camera 0,3,4,0"), {"--camera", "'0,3,4,0'"}, "x");
    expectFailure(volcomp("scene.toml --camera 0,3,4,0,3,4"), {"--camera"}, "x");
    EXPECT_TRUE(has(stages("--camera 0,3,4,0,0,0,20"), "render"));
}

TEST_F(Daily, WatchesTheSceneAndItsFiles)
{
    const std::string folder = path("").string();
    ASSERT_EQ(std::system(("cd '" + folder
                           + "' && { '" VOLCOMP_BIN
                             "/volcomp' scene.toml --watch >watch.txt 2>&1 & echo $! >pid; "
                             "wait $!; echo $? >status; } &")
                              .c_str()),
              0);
    // Waits until the log has a text that many times.
    const auto wait = [&](const std::string& text, int times) {
        for (int i = 0; i < 3000; ++i) {
            const std::string log = read("watch.txt");
            int count = 0;
            for (std::size_t at = log.find(text); at != log.npos; at = log.find(text, at + 1))
                ++count;
            if (count >= times) return true;
            std::this_thread::sleep_for(std::chrono::milliseconds(20));
        }
        return false;
    };
    const std::string preview = "out/scene/scene.preview.png";
    ASSERT_TRUE(wait("is complete", 1)) << read("watch.txt");
    const auto first = readImage(path(preview)).pixels;
    writeSceneWith("direction = [-1", "direction = [-1, -2, -2]");
    ASSERT_TRUE(wait("is complete", 2)) << read("watch.txt");
    EXPECT_NE(readImage(path(preview)).pixels, first);
    write("scene.toml", "[render]\nsampels = 3\n");
    ASSERT_TRUE(wait("did you mean 'samples'?", 1)) << read("watch.txt");
    write("scene.toml", kScene);
    ASSERT_TRUE(wait("is complete", 3)) << read("watch.txt");
    EXPECT_EQ(readImage(path(preview)).pixels, first);
    // Only the light and the error came between: boxes were read once.
    const std::string log = read("watch.txt");
    EXPECT_EQ(log.find("read boxes: "), log.rfind("read boxes: ")) << log;
    // A camera that comes nearer wants finer voxels than are there.
    writeSceneWith("eye =", "eye = [0, 0.5, 0.7]");
    ASSERT_TRUE(wait("is complete", 4)) << read("watch.txt");
    stages();
    EXPECT_EQ(readImage(path(preview)).pixels, readImage(path("out/scene/scene.png")).pixels);
    write("where.pgm", "P2\n2 1\n255\n60 60\n");
    ASSERT_TRUE(wait("is complete", 5)) << read("watch.txt");
    EXPECT_NE(readImage(path(preview)).pixels, first);
    ASSERT_EQ(std::system(("kill -INT $(cat '" + folder + "pid')").c_str()), 0);
    for (int i = 0; i < 3000 && read("status").empty(); ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
    EXPECT_EQ(read("status"), "0\n") << read("watch.txt");
}

} // namespace
} // namespace volcomp
