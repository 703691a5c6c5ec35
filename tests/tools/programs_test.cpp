// SPDX-License-Identifier: Apache-2.0
// The programs run as processes: a whole small scene, and every kind of bad input.
#include <filesystem>
#include <string>
#include <utility>

#include <gtest/gtest.h>
#include <openvdb/openvdb.h>

#include "tests/tools/programs.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;

TEST_F(Programs, ASceneBecomesAPictureAndStatistics)
{
    const Outcome baked = run("bake", "scene.toml -o boxes --stats bake.json");
    ASSERT_EQ(baked.status, 0) << baked.output;
    EXPECT_TRUE(exists("boxes/tuft_1.vdb") && exists("boxes/tuft_2.vdb"));
    const Outcome composed = compose("--stats compose.json");
    ASSERT_EQ(composed.status, 0) << composed.output;
    const Outcome rendered = render("-o a.exr -o a.png --stats render.json");
    ASSERT_EQ(rendered.status, 0) << rendered.output;
    EXPECT_TRUE(exists("a.exr") && exists("a.png"));
    for (const char* name : {"bake.json", "compose.json", "render.json"}) {
        const auto stats = readJson(name);
        EXPECT_GT(stats["total"]["wall_seconds"], 0) << name;
        EXPECT_GT(stats["peak_memory_mb"], 1) << name;
        EXPECT_FALSE(stats["stages"].empty()) << name;
    }
    const auto render_stats = readJson("render.json");
    EXPECT_EQ(render_stats["render"]["rays"], 48 * 32);
    EXPECT_EQ(render_stats["settings"]["filter"], "box");
}

TEST_F(Programs, TheSameBytesForAnyNumberOfThreads)
{
    for (const char* threads : {"1", "2"}) {
        const std::string t = threads;
        ASSERT_EQ(run("bake", "scene.toml -o boxes --threads " + t).status, 0);
        ASSERT_EQ(compose("--threads " + t).status, 0);
        ASSERT_EQ(render("-o a" + t + ".png --threads " + t).status, 0);
        fs::rename(path("boxes"), path("boxes" + t));
        fs::rename(path("volume.vdb"), path("volume" + t + ".vdb"));
        fs::remove_all(path("boxes"));
    }
    EXPECT_EQ(readBody("boxes1/tuft_1.vdb"), readBody("boxes2/tuft_1.vdb"));
    EXPECT_EQ(readBody("volume1.vdb"), readBody("volume2.vdb"));
    EXPECT_TRUE(read("a1.png") == read("a2.png"));
    EXPECT_GT(read("a1.png").size(), 100u);
}

TEST_F(Programs, HelpVersionAndWrongArguments)
{
    for (const auto& [program, required] :
         {std::pair("bake", ""), {"compose", "--boxes boxes "}, {"render", ""}}) {
        const Outcome help = run(program, "--help");
        EXPECT_EQ(help.status, 0);
        for (const char* option : {"--quiet", "--threads", "--version", "--stats"})
            EXPECT_NE(help.output.find(option), std::string::npos) << program << option;
        const Outcome version = run(program, "--version");
        EXPECT_EQ(version.status, 0);
        EXPECT_EQ(version.output.find(std::string("volcomp-") + program + " 0."), 0U)
            << version.output;
        for (const char* part : {"OpenVDB 1", "OpenImageIO 2", "OpenMesh ", "CGAL ", "TBB 20",
                                 "Vector instructions", "GPL-3.0-or-later", "Apache-2.0"})
            EXPECT_NE(version.output.find(part), std::string::npos) << part << version.output;
        const Outcome wrong =
            run(program, std::string("scene.toml -o x ") + required + "--colour blue");
        EXPECT_EQ(wrong.status, 2);
        EXPECT_NE(wrong.output.find("--colour"), std::string::npos) << wrong.output;
        EXPECT_EQ(run(program, "").status, 2);
        EXPECT_EQ(run(program, "scene.toml -o x --threads abc").status, 2);
    }
}

TEST_F(Programs, QuietSaysNothing)
{
    EXPECT_EQ(run("bake", "scene.toml -o boxes --quiet").output, "");
}

TEST_F(Programs, BadSceneFiles)
{
    expectFailure(run("bake", "none.toml -o boxes"), {"none.toml", "no readable file"}, "boxes");
    write("empty.toml", "");
    expectFailure(run("bake", "empty.toml -o boxes"), {"empty.toml", "empty file"}, "boxes");
    write("cut.toml", std::string(kScene).substr(0, 150) + "\n[[box");
    expectFailure(run("bake", "cut.toml -o boxes"), {"cut.toml", "not valid TOML"}, "boxes");
    expectFailure(run("bake", ". -o boxes"), {"a directory"}, "boxes");
    fs::copy_file(path("where.pgm"), path("picture.toml"));
    expectFailure(run("bake", "picture.toml -o boxes"), {"picture.toml"}, "boxes");
}

TEST_F(Programs, BadValuesInTheScene)
{
    struct Case {
        const char *from, *to, *expected;
    };
    for (const Case& c :
         {Case{"radius", "radius = nan", "radius"}, Case{"length", "length = -0.1", "length"},
          Case{"count", "count = \"many\"", "count"},
          Case{"segments", "segmnets = 4", "did you mean 'segments'"},
          Case{"variants", "variants = 0", "variants"},
          Case{"material = \"fur\"", "material = \"far\"", "the name of a material"},
          Case{"eye", "eye = [0, 0, 0]", "target"},
          Case{"direction", "direction = [0, 0, 0]", "not zero"},
          Case{"width", "width = 0", "width"}, Case{"height", "height = 1e3", "whole number"},
          Case{"density", "density = inf", "density"}, Case{"eye", "eye = [0, 1]", "three numbers"},
          Case{"voxel", "voxel = -1", "voxel"}}) {
        writeSceneWith(c.from, c.to);
        expectFailure(run("bake", "scene.toml -o boxes"), {"scene.toml:", c.expected}, "boxes");
    }
}

TEST_F(Programs, BadMeshes)
{
    ASSERT_EQ(bake().status, 0);
    fs::remove(path("ground.obj"));
    expectFailure(compose(), {"ground.obj"}, "volume.vdb");
    for (const char* text :
         {"", "this is no mesh\n", "v 0 0 0\nv 1 0 0\n", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n",
          "v 0 0 0\nv 1 0 0\nv 0 0 nan\nf 1 2 3\n", "v 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 2 9\n"}) {
        write("ground.obj", text);
        expectFailure(compose(), {"ground.obj"}, "volume.vdb");
    }
    writeSceneWith("mesh", "mesh = \"ground.xyz\"");
    write("ground.xyz", kMesh);
    expectFailure(compose(), {"ground.xyz", "OBJ"}, "volume.vdb");
}

TEST_F(Programs, BadMaps)
{
    ASSERT_EQ(bake().status, 0);
    fs::remove(path("where.pgm"));
    expectFailure(compose(), {"where.pgm"}, "volume.vdb");
    for (const char* text : {"", "no picture", "P2\n2 1\n"}) {
        write("where.pgm", text);
        expectFailure(compose(), {"where.pgm"}, "volume.vdb");
    }
}

TEST_F(Programs, BadVolumes)
{
    expectFailure(compose(), {"tuft_1.vdb"}, "volume.vdb");
    expectFailure(render(), {"volume.vdb", "no file"}, "a.exr");
    write("volume.vdb", "");
    expectFailure(render(), {"volume.vdb", "empty"}, "a.exr");
    write("volume.vdb", std::string(4000, 'x'));
    expectFailure(render(), {"volume.vdb"}, "a.exr");

    openvdb::initialize();
    auto grid = openvdb::FloatGrid::create(0.0f);
    grid->setName("density");
    grid->tree().setValue(openvdb::Coord(1, 2, 3), -1.0f);
    openvdb::io::File(path("volume.vdb").string()).write({grid});
    expectFailure(render(), {"volume.vdb", "(1, 2, 3)", "-1"}, "a.exr");
    auto vectors = openvdb::Vec3SGrid::create();
    vectors->setName("density");
    openvdb::io::File(path("volume.vdb").string()).write({vectors});
    expectFailure(render(), {"volume.vdb", "density"}, "a.exr");
}

TEST_F(Programs, OutputsThatCannotBe)
{
    bakeAndCompose();
    expectFailure(run("bake", "scene.toml -o more --sheet a.gif"), {"a.gif", ".exr"}, "more");
    expectFailure(render("-o a.gif"), {"a.gif", ".exr"}, "a.gif");
    expectFailure(render("-o /proc/none/a.exr"), {"/proc/none"}, "a.exr");
    fs::create_directories(path("d.exr"));
    EXPECT_EQ(render("-o d.exr").status, 1);
}

} // namespace
} // namespace volcomp
