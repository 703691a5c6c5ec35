// The programs run as processes: a whole small scene, and every kind of bad input.
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <openvdb/openvdb.h>
#include <sys/wait.h>

namespace {

namespace fs = std::filesystem;

constexpr const char* kScene = R"(
[material.fur]
kind = "fibre"

[material.skin]
kind = "surface"

[box.tuft]
material = "fur"
variants = 2
voxel = 0.01

[[box.tuft.level]]
count = 12
spread = 0.05
length = 0.2
radius = 0.004
segments = 4
angle_degrees = [0, 20]

[surface.ground]
mesh = "ground.obj"
skin = "skin"

[[layer]]
name = "fur"
box = "tuft"
density = 60

[[layer.where]]
image = "where.pgm"

[compose]
voxel = 0.02

[camera]
eye = [0, 1.5, 2.0]
target = [0, 0, 0]

[[light]]
direction = [-1, -2, -1]

[render]
width = 48
height = 32
)";

constexpr const char* kMesh =
    "v -0.5 0 0.5\nv 0.5 0 0.5\nv 0.5 0 -0.5\nv -0.5 0 -0.5\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n";

struct Outcome {
    int status;
    std::string output;
};

class Programs : public testing::Test {
protected:
    void SetUp() override
    {
        m_dir = fs::path(testing::TempDir())
            / ("programs_"
               + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
        fs::remove_all(m_dir);
        fs::create_directories(m_dir);
        write("scene.toml", kScene);
        write("ground.obj", kMesh);
        write("where.pgm", "P2\n2 1\n255\n255 128\n");
    }
    void TearDown() override { fs::remove_all(m_dir); }

    fs::path path(const std::string& name) const { return m_dir / name; }
    void write(const std::string& name, const std::string& text)
    {
        std::ofstream(path(name), std::ios::binary) << text;
    }
    std::string read(const std::string& name)
    {
        std::ifstream stream(path(name), std::ios::binary);
        std::stringstream text;
        text << stream.rdbuf();
        return text.str();
    }

    /// The scene with the line that starts with `from` replaced.
    void writeSceneWith(const std::string& from, const std::string& to)
    {
        std::string text = kScene;
        const auto at = text.find("\n" + from);
        ASSERT_NE(at, std::string::npos) << from;
        text.replace(at + 1, text.find('\n', at + 1) - at - 1, to);
        write("scene.toml", text);
    }

    Outcome run(const std::string& program, const std::string& arguments)
    {
        const fs::path log = path("log.txt");
        const std::string command = "cd '" + m_dir.string() + "' && '" VOLCOMP_BIN "/volcomp-"
            + program + "' " + arguments + " >'" + log.string() + "' 2>&1";
        const int status = std::system(command.c_str());
        Outcome outcome{WIFEXITED(status) ? WEXITSTATUS(status) : 128, read("log.txt")};
        fs::remove(log);
        return outcome;
    }
    Outcome bake() { return run("bake", "scene.toml -o boxes"); }
    Outcome compose(const std::string& more = "")
    {
        return run("compose", "scene.toml --boxes boxes -o volume.vdb " + more);
    }
    Outcome render(const std::string& more = "-o a.exr")
    {
        return run("render", "scene.toml --volume volume.vdb " + more);
    }

    /// One failure: status 1, a message with all `parts`, and no output under its final name or any
    /// other.
    void expectFailure(const Outcome& outcome, std::initializer_list<const char*> parts,
                       const std::string& output)
    {
        EXPECT_EQ(outcome.status, 1) << outcome.output;
        for (const char* part : parts)
            EXPECT_NE(outcome.output.find(part), std::string::npos)
                << "'" << part << "' is not in: " << outcome.output;
        EXPECT_FALSE(fs::exists(path(output))) << output;
        for (const auto& entry : fs::recursive_directory_iterator(m_dir))
            EXPECT_EQ(entry.path().string().find(".part"), std::string::npos) << entry.path();
    }

private:
    fs::path m_dir;
};

TEST_F(Programs, aSceneBecomesAPictureAndStatistics)
{
    const Outcome baked = run("bake", "scene.toml -o boxes --stats bake.json");
    ASSERT_EQ(baked.status, 0) << baked.output;
    EXPECT_TRUE(fs::exists(path("boxes/tuft_1.vdb")) && fs::exists(path("boxes/tuft_2.vdb")));
    const Outcome composed = compose("--stats compose.json");
    ASSERT_EQ(composed.status, 0) << composed.output;
    const Outcome rendered = render("-o a.exr -o a.png --stats render.json");
    ASSERT_EQ(rendered.status, 0) << rendered.output;
    EXPECT_TRUE(fs::exists(path("a.exr")) && fs::exists(path("a.png")));
    for (const char* name : {"bake.json", "compose.json", "render.json"}) {
        const auto stats = nlohmann::json::parse(read(name));
        EXPECT_GT(stats["total"]["wall_seconds"], 0) << name;
        EXPECT_GT(stats["peak_memory_mb"], 1) << name;
        EXPECT_FALSE(stats["stages"].empty()) << name;
    }
    const auto render_stats = nlohmann::json::parse(read("render.json"));
    EXPECT_EQ(render_stats["render"]["rays"], 48 * 32);
    EXPECT_EQ(render_stats["settings"]["filter"], "box");
}

TEST_F(Programs, theSameBytesForAnyNumberOfThreads)
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
    // A VDB file starts with a random identifier of 36 characters behind its 20 bytes of header;
    // the rest must agree.
    const auto body = [&](const std::string& name) { return read(name).substr(64); };
    EXPECT_EQ(body("boxes1/tuft_1.vdb"), body("boxes2/tuft_1.vdb"));
    EXPECT_EQ(body("volume1.vdb"), body("volume2.vdb"));
    EXPECT_TRUE(read("a1.png") == read("a2.png"));
    EXPECT_GT(read("a1.png").size(), 100u);
}

TEST_F(Programs, helpVersionAndWrongArguments)
{
    for (const auto& [program, required] :
         {std::pair("bake", ""), {"compose", "--boxes boxes "}, {"render", ""}}) {
        const Outcome help = run(program, "--help");
        EXPECT_EQ(help.status, 0);
        for (const char* option : {"--quiet", "--threads", "--version", "--stats"})
            EXPECT_NE(help.output.find(option), std::string::npos) << program << option;
        EXPECT_EQ(run(program, "--version").status, 0);
        const Outcome wrong =
            run(program, std::string("scene.toml -o x ") + required + "--colour blue");
        EXPECT_EQ(wrong.status, 2);
        EXPECT_NE(wrong.output.find("--colour"), std::string::npos) << wrong.output;
        EXPECT_EQ(run(program, "").status, 2);
        EXPECT_EQ(run(program, "scene.toml -o x --threads abc").status, 2);
    }
}

TEST_F(Programs, quietSaysNothing)
{
    EXPECT_EQ(run("bake", "scene.toml -o boxes --quiet").output, "");
}

TEST_F(Programs, badSceneFiles)
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

TEST_F(Programs, badValuesInTheScene)
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

TEST_F(Programs, surfacesAreLeftOut)
{
    ASSERT_EQ(bake().status, 0);
    expectFailure(compose("--leave-out grund"), {"--leave-out", "(ground)", "'grund'"},
                  "volume.vdb");
    writeSceneWith(
        "[[layer]]",
        "[surface.wall]\nmesh = \"ground.obj\"\nskin = \"skin\"\n\n[[layer]]\nsurface = \"ground\"");
    ASSERT_EQ(compose("--stats with.json").status, 0);
    ASSERT_EQ(compose("--stats without.json --leave-out ground").status, 0);
    const auto with = nlohmann::json::parse(read("with.json")),
               without = nlohmann::json::parse(read("without.json"));
    EXPECT_EQ(with["surfaces"].size(), 2u);
    EXPECT_TRUE(without["surfaces"].contains("wall") && without["surfaces"].size() == 1);
    EXPECT_GT(with["placements"], 10);
    EXPECT_EQ(without["placements"], 0);
    EXPECT_GT(without["active_voxels"], 100);
}

TEST_F(Programs, badMeshes)
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

TEST_F(Programs, badMaps)
{
    ASSERT_EQ(bake().status, 0);
    fs::remove(path("where.pgm"));
    expectFailure(compose(), {"where.pgm"}, "volume.vdb");
    for (const char* text : {"", "no picture", "P2\n2 1\n"}) {
        write("where.pgm", text);
        expectFailure(compose(), {"where.pgm"}, "volume.vdb");
    }
}

TEST_F(Programs, badVolumes)
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

TEST_F(Programs, outputsThatCannotBe)
{
    ASSERT_EQ(bake().status, 0);
    ASSERT_EQ(compose().status, 0);
    expectFailure(run("bake", "scene.toml -o more --sheet a.gif"), {"a.gif", ".exr"}, "more");
    expectFailure(render("-o a.gif"), {"a.gif", ".exr"}, "a.gif");
    expectFailure(render("-o /proc/none/a.exr"), {"/proc/none"}, "a.exr");
    fs::create_directories(path("d.exr"));
    EXPECT_EQ(render("-o d.exr").status, 1);
}

// The real program, ended by both signals as soon as it has saved something.
TEST_F(Programs, aKilledRenderGoesOnToTheSamePixels)
{
    ASSERT_EQ(bake().status, 0);
    ASSERT_EQ(compose().status, 0);
    const std::string job = "scene.toml --volume volume.vdb --samples 100 --checkpoint 0.02 ";
    ASSERT_EQ(run("render", job + "-o whole.png").status, 0);
    EXPECT_FALSE(fs::exists(path("whole.png.checkpoint")));
    for (const std::string signal : {"KILL", "TERM"}) {
        const std::string picture = signal + ".png",
                          command = "cd '" + path("").string()
            + "'; '" VOLCOMP_BIN "/volcomp-render' " + job + "-o " + picture + " >" + signal
            + ".txt 2>&1 & pid=$!; for i in $(seq 1000); do [ -f '" + path(picture).string()
            + ".checkpoint' ] && break; sleep 0.01; done; kill -" + signal + " $pid; wait $pid";
        const int status =
            std::system(("bash -c \"" + std::regex_replace(command, std::regex("[$]"), "\\$")
                         + "\" 2>/dev/null")
                            .c_str());
        EXPECT_NE(status, 0) << "not killed in time";
        EXPECT_FALSE(fs::exists(path(picture)));
        ASSERT_TRUE(fs::exists(path(picture + ".checkpoint")));
        if (signal == "TERM") {
            EXPECT_NE(read("TERM.txt").find("--resume goes on"), std::string::npos)
                << read("TERM.txt");
        }

        const Outcome other =
            run("render", "scene.toml --volume volume.vdb --samples 101 --resume -o " + picture);
        expectFailure(other, {"checkpoint", "samples = 101", "100"}, picture);
        const Outcome resumed = run("render", job + "--resume --threads 1 -o " + picture);
        EXPECT_EQ(resumed.status, 0) << resumed.output;
        EXPECT_NE(resumed.output.find("going on from"), std::string::npos) << resumed.output;
        EXPECT_TRUE(read(picture) == read("whole.png"));
        EXPECT_FALSE(fs::exists(path(picture + ".checkpoint")));
    }
    write("a.png.checkpoint", "no checkpoint");
    expectFailure(run("render", job + "--resume -o a.png"), {"a.png.checkpoint", "damaged"},
                  "a.png");
}

// Levels are written once, read from then on, and said to be unfit when the volume is another.
TEST_F(Programs, levelsOfDetailAreWrittenAndRead)
{
    ASSERT_EQ(bake().status, 0);
    ASSERT_EQ(compose().status, 0);
    const std::string job = "scene.toml --volume volume.vdb --size 6x4 --lod --samples 16 ";
    const Outcome written = run("render", job + "--write-levels -o a.png");
    EXPECT_EQ(written.status, 0) << written.output;
    EXPECT_NE(written.output.find("levels: "), std::string::npos) << written.output;
    ASSERT_TRUE(fs::exists(path("volume.level1.vdb")));
    const Outcome again = run("render", job + "--write-levels -o b.png");
    EXPECT_EQ(again.output.find("levels: "), std::string::npos) << again.output;
    EXPECT_TRUE(read("a.png") == read("b.png"));
    EXPECT_EQ(run("render", job + "-o c.png --threads 1").status, 0);
    EXPECT_TRUE(read("a.png") == read("c.png"));

    ASSERT_EQ(compose().status, 0);
    const Outcome stale = run("render", job + "-o d.png");
    EXPECT_EQ(stale.status, 0);
    EXPECT_NE(stale.output.find("volume.level1.vdb is not used: it was made of another volume"), std::string::npos)
        << stale.output;
}

TEST_F(Programs, aPreviewChangesNoPixel)
{
    ASSERT_EQ(bake().status, 0);
    ASSERT_EQ(compose().status, 0);
    ASSERT_EQ(render("--samples 5 -o a.png").status, 0);
    ASSERT_EQ(render("--samples 5 -o b.png --preview preview.png").status, 0);
    EXPECT_TRUE(read("a.png") == read("b.png"));
    EXPECT_TRUE(fs::exists(path("preview.png")));
    expectFailure(render("--preview preview.gif -o c.png"), {"preview.gif"}, "c.png");
}

// The whole matrix on a small picture; the second run measures nothing again and draws the same.
TEST_F(Programs, theChartIsMeasuredOnceAndDrawn)
{
    if (std::system("command -v gnuplot >/dev/null") != 0)
        GTEST_SKIP() << "gnuplot is not installed";
    const std::string command =
        "scene.toml -o chart --width 24 --samples 5 --no-voxels --stats chart.json";
    const Outcome first = run("chart", command);
    ASSERT_EQ(first.status, 0) << first.output;
    const std::string csv = read("chart/results.csv"), table = read("chart/table.md");
    for (const char* name : {"\"sweep, 4\"", "\"trilinear, 1\"", "\"riemann, step 1, 4\"",
                             "\"no shadows, 4\"", "\"exact, box\""})
        EXPECT_NE(csv.find(name), std::string::npos) << name;
    EXPECT_NE(table.find("| 0.1 |"), std::string::npos) << table;
    EXPECT_EQ(read("chart/chart.png").substr(1, 3), "PNG");
    EXPECT_NE(read("chart/chart.svg").find("<svg"), std::string::npos);
    // Against itself with the same rays a method has no error but the cutoff's.
    std::smatch found;
    const std::string row = csv.substr(csv.find("radiance,\"trilinear, cutoff 0, 4\""));
    ASSERT_TRUE(std::regex_search(
        row, found, std::regex("^radiance,\"[^\"]*\",\"[^\"]*\",[0-9.]+,([^,]+),([^,]+),")));
    EXPECT_LT(std::stod(found[2]), 1e-4);
    EXPECT_GT(std::stod(found[1]), 1e-3);

    const Outcome second = run("chart", command);
    ASSERT_EQ(second.status, 0) << second.output;
    EXPECT_EQ(read("chart/results.csv"), csv);
    EXPECT_EQ(nlohmann::json::parse(read("chart.json"))["stages"].size(), 1u)
        << second.output; // drawing
}

TEST_F(Programs, aForeignVolumeIsRendered)
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
