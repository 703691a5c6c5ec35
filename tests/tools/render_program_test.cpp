// SPDX-License-Identifier: Apache-2.0
// volcomp-render run as a process: its options, and renders that are stopped and resumed.
#include <chrono>
#include <filesystem>
#include <string>
#include <thread>
#include <utility>

#include <gtest/gtest.h>
#include <openvdb/openvdb.h>
#include <signal.h>
#include <spawn.h>

#include "volcomp/view/image.h"
#include "tests/tools/programs.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;

/// A render that was sent a signal.
struct Killed {
    bool in_time;   ///< false if the render was complete before the signal
    int status = 0; ///< what waitpid() says
};

/// Runs volcomp-render in `folder`, sends the signal when the file `checkpoint` is there, however
/// long that takes, and waits for the end. What it says goes to the file `log`.
Killed renderAndKill(const fs::path& folder, const std::string& arguments,
                     const fs::path& checkpoint, const fs::path& log, int signal)
{
    const std::string command = "cd '" + folder.string()
        + "' && exec '" VOLCOMP_BIN "/volcomp-render' " + arguments + " >'" + log.string()
        + "' 2>&1";
    std::string shell = "sh", option = "-c", text = command;
    char* const argv[] = {shell.data(), option.data(), text.data(), nullptr};
    pid_t pid = 0;
    Killed killed{false};
    if (posix_spawnp(&pid, "sh", nullptr, nullptr, argv, environ) != 0) return killed;
    while (!fs::exists(checkpoint)) {
        if (waitpid(pid, &killed.status, WNOHANG) == pid) return {false, killed.status};
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    kill(pid, signal);
    waitpid(pid, &killed.status, 0);
    killed.in_time = !(WIFEXITED(killed.status) && WEXITSTATUS(killed.status) == 0);
    return killed;
}

// A machine so quick that the render is complete before the signal gets more samples to take.
TEST_F(Programs, AKilledRenderGoesOnToTheSamePixels)
{
    bakeAndCompose();
    for (const auto& [signal, name] : {std::pair(SIGKILL, "kill"), {SIGTERM, "term"}}) {
        const std::string picture = std::string(name) + ".png",
                          checkpoint = picture + ".checkpoint", log = std::string(name) + ".txt";
        int samples = 50;
        std::string job;
        Killed killed{false};
        while (!killed.in_time) {
            ASSERT_LT(samples *= 2, 60000);
            job = "scene.toml --volume volume.vdb --checkpoint 0.02 --samples "
                + std::to_string(samples) + " -o ";
            killed = renderAndKill(path(""), job + picture, path(checkpoint), path(log), signal);
            if (!killed.in_time) {
                ASSERT_TRUE(WIFEXITED(killed.status) && WEXITSTATUS(killed.status) == 0)
                    << read(log);
                fs::remove(path(picture));
            }
        }
        EXPECT_FALSE(exists(picture));
        ASSERT_TRUE(exists(checkpoint));
        if (signal == SIGKILL)
            EXPECT_TRUE(WIFSIGNALED(killed.status) && WTERMSIG(killed.status) == SIGKILL);
        else {
            EXPECT_TRUE(WIFEXITED(killed.status) && WEXITSTATUS(killed.status) == 1);
            EXPECT_NE(read(log).find("--resume goes on"), std::string::npos) << read(log);
        }

        const std::string more = std::to_string(samples + 1), said = "samples = " + more;
        const Outcome other =
            run("render",
                "scene.toml --volume volume.vdb --resume --samples " + more + " -o " + picture);
        expectFailure(other, {"checkpoint", said.c_str(), std::to_string(samples).c_str()},
                      picture);
        const Outcome resumed = run("render", job + picture + " --resume --threads 1");
        EXPECT_EQ(resumed.status, 0) << resumed.output;
        EXPECT_NE(resumed.output.find("going on from"), std::string::npos) << resumed.output;
        EXPECT_FALSE(exists(checkpoint));
        ASSERT_EQ(run("render", job + "whole.png").status, 0);
        EXPECT_TRUE(read(picture) == read("whole.png"));
        EXPECT_FALSE(exists("whole.png.checkpoint"));
    }
}

TEST_F(Programs, ADamagedCheckpointIsRefused)
{
    bakeAndCompose();
    write("a.png.checkpoint", "no checkpoint");
    expectFailure(render("--resume -o a.png"), {"a.png.checkpoint", "damaged"}, "a.png");
}

// Every sample of a pixel depends on the pixel's place in the whole picture, and exact shadows
// depend on nothing else, so that a part has the very pixels of the whole.
TEST_F(Programs, ACropHasThePixelsOfTheWholePicture)
{
    bakeAndCompose();
    for (const std::string filter : {"box", "trilinear"})
        for (const std::string pixel_filter : {"box", "gaussian", "blackman-harris"}) {
            const std::string settings = "--shadows exact --samples 3 --filter " + filter
                + " --pixel-filter " + pixel_filter;
            ASSERT_EQ(render(settings + " -o whole.exr").status, 0);
            ASSERT_EQ(render(settings + " --crop 13,9,21,18 -o part.exr").status, 0);
            const Image whole = readImage(path("whole.exr")), part = readImage(path("part.exr"));
            ASSERT_EQ(part.width, 21);
            ASSERT_EQ(part.height, 18);
            ASSERT_EQ(part.channels, whole.channels);
            int different = 0, lit = 0;
            for (int y = 0; y < part.height; ++y)
                for (int x = 0; x < part.width; ++x)
                    for (std::size_t c = 0; c < part.channels.size(); ++c) {
                        different += part.pixel(x, y)[c] != whole.pixel(13 + x, 9 + y)[c];
                        lit += part.pixel(x, y)[c] > 0;
                    }
            EXPECT_EQ(different, 0) << settings;
            EXPECT_GT(lit, 21 * 18) << settings;
        }
}

TEST_F(Programs, ACropOutsideThePictureIsRefused)
{
    bakeAndCompose();
    for (const char* crop : {"40,0,9,8", "0,30,8,3", "-1,0,8,8", "48,32,1,1"})
        expectFailure(render("-o a.exr --crop=" + std::string(crop)), {"a crop inside the picture"},
                      "a.exr");
    for (const char* crop : {"1,2,3", "1,2,3,4,5", "all"})
        expectFailure(render("-o a.exr --crop=" + std::string(crop)),
                      {"--crop: expected X,Y,WIDTH,HEIGHT", crop}, "a.exr");
}

TEST_F(Programs, APreviewChangesNoPixel)
{
    bakeAndCompose();
    ASSERT_EQ(render("--samples 5 -o a.png").status, 0);
    ASSERT_EQ(render("--samples 5 -o b.png --preview preview.png").status, 0);
    EXPECT_TRUE(read("a.png") == read("b.png"));
    EXPECT_TRUE(exists("preview.png"));
    expectFailure(render("--preview preview.gif -o c.png"), {"preview.gif"}, "c.png");
}

TEST_F(Programs, AForeignVolumeIsRendered)
{
    openvdb::initialize();
    auto grid = openvdb::FloatGrid::create(0.0f);
    grid->setName("density");
    grid->setTransform(openvdb::math::Transform::createLinearTransform(0.05));
    grid->fill(openvdb::CoordBBox(openvdb::Coord(-8), openvdb::Coord(7)), 20.0f);
    openvdb::io::File(path("volume.vdb").string()).write({grid});
    for (const char* undirected : {"isotropic", "gradient"}) {
        write(
            "plain.toml",
            std::string(
                "[camera]\neye = [0, 1.5, 2]\ntarget = [0, 0, 0]\n[[light]]\ndirection = [-1, -2, -1]\n[render]\nwidth = 32\nheight = 24\nundirected = \"")
                + undirected + "\"\n");
        const Outcome outcome =
            run("render", "plain.toml --volume volume.vdb -o " + std::string(undirected) + ".exr");
        EXPECT_EQ(outcome.status, 0) << outcome.output;
        EXPECT_TRUE(fs::exists(path(std::string(undirected) + ".exr")));
    }
}

} // namespace
} // namespace volcomp
