// SPDX-License-Identifier: Apache-2.0
// The programs run as processes: what cannot be written, what must not be overwritten, devices,
// pipes, a full disk, and too little memory.
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include "tests/support/sanitizer.h"
#include "tests/tools/programs.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;

bool has(const std::string& text, const std::string& part)
{
    return text.find(part) != std::string::npos;
}

/// Makes a copy of /dev/full with a picture's name; false if this user cannot.
bool makeFullDevice(const fs::path& file)
{
    if (mknod(file.c_str(), S_IFCHR | 0666, makedev(1, 7)) != 0) return false;
    chmod(file.c_str(), 0666);
    return access(file.c_str(), W_OK) == 0;
}

// A stage says how long it took when it is done, so that nothing said means nothing done.
TEST_F(Programs, WhatCannotBeWrittenIsRefusedBeforeTheWork)
{
    bakeAndCompose();
    fs::create_directories(path("d.exr"));
    fs::create_directories(path("d.json"));
    fs::create_directories(path("d.vdb"));
    fs::create_directories(path("e.exr.checkpoint"));
    fs::create_directories(path("full/tuft_2.vdb"));
    const std::string bake = "scene.toml ", compose = "scene.toml --boxes boxes ",
                      render = "scene.toml --volume volume.vdb ";
    struct Case {
        const char* program;
        std::string arguments;
        const char* named;
    };
    for (const Case& c : {Case{"bake", bake + "-o /proc/none", "/proc/none"},
                          Case{"bake", bake + "-o full", "tuft_2.vdb"},
                          Case{"bake", bake + "-o more --sheet d.exr", "d.exr"},
                          Case{"bake", bake + "-o more --stats d.json", "d.json"},
                          Case{"compose", compose + "-o d.vdb", "d.vdb"},
                          Case{"compose", compose + "-o new/", "new/"},
                          Case{"compose", compose + "-o /proc/none/a.vdb", "/proc/none"},
                          Case{"compose", compose + "-o a.vdb --placements d.json", "d.json"},
                          Case{"compose", compose + "-o a.vdb --placements a.txt", "a.txt"},
                          Case{"compose", compose + "-o a.vdb --stats d.json", "d.json"},
                          Case{"render", render + "-o d.exr", "d.exr"},
                          Case{"render", render + "-o a.exr -o d.exr", "d.exr"},
                          Case{"render", render + "-o e.exr", "e.exr.checkpoint"},
                          Case{"render", render + "-o a.exr --preview d.exr", "d.exr"},
                          Case{"render", render + "-o a.exr --stats d.json", "d.json"}}) {
        const Outcome outcome = run(c.program, c.arguments);
        expectFailure(outcome, {c.named}, "a.exr");
        EXPECT_FALSE(has(outcome.output, " s\n")) << c.arguments << ": " << outcome.output;
        EXPECT_FALSE(exists("more") || exists("a.vdb") || exists("new")) << c.arguments;
    }
    EXPECT_EQ(run("render", render + "-o e.exr --checkpoint 0").status, 0);
}

TEST_F(Programs, APipeAsCheckpointIsRefused)
{
    bakeAndCompose();
    ASSERT_EQ(mkfifo(path("a.png.checkpoint").c_str(), 0600), 0);
    for (const char* more : {"-o a.png", "-o a.png --resume"})
        expectFailure(render(more), {"a.png.checkpoint", "a pipe"}, "a.png");
}

TEST_F(Programs, OutputsOverwriteNeitherInputsNorEachOther)
{
    write("other.toml", "[material.skin]\nkind = \"surface\"\n");
    writeSceneWith("[material.fur]", "include = \"other.toml\"\n[material.fur]");
    bakeAndCompose();
    fs::create_symlink("scene.toml", path("link.json"));
    const std::string scene = read("scene.toml"), volume = read("volume.vdb"),
                      box = read("boxes/tuft_1.vdb");
    const std::string bake = "scene.toml ", compose = "scene.toml --boxes boxes ",
                      render = "scene.toml --volume volume.vdb ";
    struct Case {
        const char* program;
        std::string arguments;
        std::initializer_list<const char*> named;
    };
    for (const Case& c :
         {Case{"compose", compose + "-o boxes/tuft_1.vdb", {"-o", "a box"}},
          Case{"compose", compose + "-o a.vdb --stats scene.toml", {"--stats", "the scene"}},
          Case{"compose", compose + "-o a.vdb --stats other.toml", {"--stats", "included"}},
          Case{"compose", compose + "-o a.vdb --placements link.json", {"--placements", "scene"}},
          Case{"compose", compose + "-o ground.obj", {"-o", "surface.ground.mesh"}},
          Case{"compose", compose + "-o a.vdb --stats where.pgm", {"--stats", "where"}},
          Case{"compose", compose + "-o a.vdb --stats ./a.vdb", {"--stats", "-o"}},
          Case{"bake", bake + "-o b --stats b/tuft_1.vdb", {"--stats", "-o"}},
          Case{"bake", bake + "-o b --sheet a.png --stats a.png", {"--stats", "--sheet"}},
          Case{"render", render + "-o a.png -o a.png", {"-o", "a.png"}},
          Case{"render", render + "-o a.png --preview a.png", {"--preview", "-o"}},
          Case{"render", render + "-o a.png --stats a.png", {"--stats", "-o"}},
          Case{"render", render + "-o a.png --stats volume.vdb", {"--stats", "the volume"}},
          Case{"render",
               render + "-o a.png --stats a.png.checkpoint",
               {"--stats", "the checkpoint"}}}) {
        expectFailure(run(c.program, c.arguments), c.named, "a.png");
        EXPECT_FALSE(exists("a.vdb") || exists("b")) << c.arguments;
    }
    EXPECT_TRUE(read("scene.toml") == scene && read("volume.vdb") == volume
                && read("boxes/tuft_1.vdb") == box);
    EXPECT_EQ(read("ground.obj"), kMesh);
}

// What only a run needs the file for is not lost: a foreign file that has the checkpoint's name
// stays if the render keeps none.
TEST_F(Programs, WithoutCheckpointsAFileOfThatNameStays)
{
    bakeAndCompose();
    write("a.png.checkpoint", "mine");
    ASSERT_EQ(render("-o a.png --checkpoint 0").status, 0);
    EXPECT_EQ(read("a.png.checkpoint"), "mine");
    ASSERT_EQ(render("-o b.png").status, 0);
    EXPECT_FALSE(exists("b.png.checkpoint"));
}

TEST_F(Programs, EveryFormatGoesThroughAPipeAndALink)
{
    ASSERT_EQ(bake().status, 0);
    const auto throughPipe = [&](const std::string& program, const std::string& arguments,
                                 const std::string& name) {
        ASSERT_EQ(mkfifo(path("pipe_" + name).c_str(), 0600), 0);
        const std::string cat = "cd '" + path("").string() + "' && cat pipe_" + name + " >" + name
            + " && touch " + name + ".done & ";
        ASSERT_EQ(std::system(cat.c_str()), 0);
        const Outcome outcome = run(program, arguments + " pipe_" + name);
        ASSERT_EQ(outcome.status, 0) << outcome.output;
        for (int i = 0; i < 1000 && !exists(name + ".done"); ++i) usleep(10000);
        EXPECT_TRUE(fs::is_fifo(path("pipe_" + name)));
    };
    throughPipe("compose", "scene.toml --boxes boxes -o", "volume.vdb");
    throughPipe("compose", "scene.toml --boxes boxes --placements", "p.json");
    throughPipe("compose", "scene.toml --boxes boxes --placements", "p.ply");
    throughPipe("render", "scene.toml --volume volume.vdb -o", "a.png");
    throughPipe("render", "scene.toml --volume volume.vdb --checkpoint 0 -o", "b.exr");
    ASSERT_EQ(run("compose", "scene.toml --boxes boxes -o v2.vdb --placements p2.json").status, 0);
    EXPECT_TRUE(readBody("volume.vdb") == readBody("v2.vdb"));
    EXPECT_TRUE(read("p.json") == read("p2.json"));
    fs::create_symlink("a2.png", path("link.png"));
    ASSERT_EQ(render("-o link.png").status, 0);
    EXPECT_TRUE(fs::is_symlink(path("link.png")));
    EXPECT_TRUE(read("a2.png").substr(0, 8) == read("a.png").substr(0, 8));
    EXPECT_EQ(read("b.exr").substr(0, 4), "\x76\x2f\x31\x01");

    const Outcome stats = run("bake", "scene.toml -o boxes -q --stats /dev/stdout");
    EXPECT_EQ(stats.status, 0);
    EXPECT_EQ(nlohmann::json::parse(stats.output)["program"], "volcomp-bake") << stats.output;
}

TEST_F(Programs, AFullDeviceIsAnErrorButNotForAPreview)
{
    bakeAndCompose();
    if (!makeFullDevice(path("full.png")))
        GTEST_SKIP() << "this user cannot make devices here: " << std::strerror(errno);
    for (const char* name : {"full.vdb", "full.json", "full.exr"})
        fs::create_symlink("full.png", path(name));
    for (const auto& [program, arguments] :
         {std::pair<const char*, std::string>("compose", "--boxes boxes -o full.vdb"),
          {"compose", "--boxes boxes --placements full.json"},
          {"bake", "-o boxes --stats full.json"},
          {"bake", "-o boxes --sheet full.png"},
          {"render", "--volume volume.vdb -o full.exr"}}) {
        const Outcome outcome = run(program, "scene.toml " + arguments);
        expectFailure(outcome, {"full.", "No space left"}, "a.png");
    }
    EXPECT_TRUE(fs::is_character_file(path("full.png")));
    ASSERT_EQ(render("-o a.png --samples 30").status, 0);
    const Outcome warned = render("-o b.png --samples 30 --preview full.png");
    EXPECT_EQ(warned.status, 0) << warned.output;
    const auto at = warned.output.find("the preview could not be written");
    ASSERT_NE(at, std::string::npos) << warned.output;
    EXPECT_TRUE(read("a.png") == read("b.png"));
}

// The preview is a pipe, which stops the render after its outputs were checked; then the folder of
// the checkpoint goes.
TEST_F(Programs, ACheckpointThatFailsLaterIsAWarning)
{
    bakeAndCompose();
    ASSERT_EQ(mkfifo(path("pipe.png").c_str(), 0600), 0);
    fs::create_directory(path("gone"));
    fs::create_symlink("gone/checkpoint", path("a.png.checkpoint"));
    write("script.sh",
          "cd '" + path("").string()
              + "'\n: >log\n'" VOLCOMP_BIN
                "/volcomp-render' scene.toml --volume volume.vdb --samples 50 "
                "--checkpoint 0.05 --preview pipe.png -o a.png >log 2>&1 &\n"
                "render=$!\n"
                "while kill -0 $render && ! grep -q 'load:' log; do sleep 0.01; done\n"
                "rmdir gone; : >gone\n"
                "cat <>pipe.png >/dev/null &\nreader=$!\n"
                "wait $render; status=$?\nkill $reader\nexit $status\n");
    const int status = std::system(("sh '" + path("script.sh").string() + "'").c_str());
    const std::string log = read("log");
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << log;
    const auto at = log.find("the checkpoint could not be written");
    ASSERT_NE(at, std::string::npos) << log;
    EXPECT_FALSE(has(log.substr(at + 1), "the checkpoint could not be written")) << "once: " << log;
    ASSERT_EQ(render("-o b.png --samples 50").status, 0);
    EXPECT_TRUE(read("a.png") == read("b.png"));
}

TEST_F(Programs, StdoutThatCannotBeWrittenIsAnError)
{
    bakeAndCompose();
    for (const char* program : {"bake", "compose", "render", "chart"})
        for (const char* option : {"--help", "--version", "--scene-keys"}) {
            const std::string command = "cd '" + path("").string()
                + "' && '" VOLCOMP_BIN "/volcomp-" + program + "' " + option + " >/dev/full 2>said";
            const int status = std::system(command.c_str());
            EXPECT_EQ(WEXITSTATUS(status), 1) << program << option;
            EXPECT_TRUE(has(read("said"), "could not be written to stdout")) << read("said");
        }
}

TEST_F(Programs, NumbersOfOptionsAreFiniteAndInTheirRange)
{
    bakeAndCompose();
    for (const auto& [program, arguments] :
         {std::pair("compose", "--boxes boxes -o a.vdb --voxel nan"),
          {"compose", "--boxes boxes -o a.vdb --voxel inf"},
          {"compose", "--boxes boxes -o a.vdb --max-memory nan"},
          {"compose", "--boxes boxes -o a.vdb --max-memory inf"},
          {"render", "--volume volume.vdb -o a.png --checkpoint nan"},
          {"render", "--volume volume.vdb -o a.png --cutoff nan"},
          {"render", "--volume volume.vdb -o a.png --step nan"},
          {"render", "--volume volume.vdb -o a.png --pixel-radius nan"},
          {"render", "--volume volume.vdb -o a.png --samples 99999999999"},
          {"bake", "-o more --threads 99999999999"},
          {"chart", "-o more --width 4294967360"}}) {
        const Outcome outcome = run(program, std::string("scene.toml ") + arguments);
        EXPECT_EQ(outcome.status, 2) << arguments;
        EXPECT_TRUE(has(outcome.output, "number from ") || has(outcome.output, "number >= "))
            << outcome.output;
    }
    EXPECT_FALSE(exists("a.vdb") || exists("a.png") || exists("more"));
    expectFailure(render("-o a.png --crop 10,5,0,8"), {"--crop", "at least 1 pixel"}, "a.png");
    expectFailure(render("-o a.png --crop 0,0,4294967304,8"), {"--crop", "2147483647"}, "a.png");
}

// Nothing can be composed in a kilobyte, and no voxel is advised then.
TEST_F(Programs, NoVoxelIsAdvisedIfNoneFits)
{
    bakeAndCompose();
    fs::remove(path("volume.vdb"));
    const Outcome none = compose("--max-memory 0.001");
    expectFailure(none, {"--max-memory", "No voxel size would fit"}, "volume.vdb");
    EXPECT_FALSE(has(none.output, " m instead of")) << none.output;
    const Outcome huge = compose("--voxel 1e-7");
    expectFailure(huge, {"more memory than any machine has", "instead of 1e-07 m"}, "volume.vdb");
    EXPECT_FALSE(has(huge.output, "inf MB")) << huge.output;
}

// With so little memory libraries fail before main() begins; above that every end has a message.
TEST_F(Programs, TooLittleMemoryIsSaid)
{
    if (kSanitized) GTEST_SKIP() << "a sanitizer needs more address space than any limit";
    bakeAndCompose();
    const auto runWithin = [&](int kilobytes, const std::string& program,
                               const std::string& arguments) {
        const std::string command = "cd '" + path("").string() + "' && ulimit -v "
            + std::to_string(kilobytes) + " && '" VOLCOMP_BIN "/volcomp-" + program + "' "
            + arguments + " >said 2>&1";
        const int status = std::system(command.c_str());
        return Outcome{WIFEXITED(status) ? WEXITSTATUS(status) : 128, read("said")};
    };
    int least = 300000; // the programs start
    while (runWithin(least, "bake", "--version").status != 0) {
        ASSERT_LT(least += 20000, 4000000);
    }
    for (int kilobytes = least + 10000; kilobytes < least + 200000; kilobytes += 45000)
        for (const auto& [program, arguments] :
             {std::pair("bake", "-o more --threads 16"),
              {"compose", "--boxes boxes -o a.vdb --threads 16"},
              {"render", "--volume volume.vdb -o a.png --threads 16"}}) {
            const Outcome outcome =
                runWithin(kilobytes, program, std::string("scene.toml ") + arguments);
            if (outcome.status == 0) continue;
            EXPECT_EQ(outcome.status, 1) << program << " " << kilobytes << ": " << outcome.output;
            EXPECT_TRUE(has(outcome.output, "memory")) << outcome.output;
            EXPECT_FALSE(has(outcome.output, "bad_alloc")) << outcome.output;
        }
}

} // namespace
} // namespace volcomp
