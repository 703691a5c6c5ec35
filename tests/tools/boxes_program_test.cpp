// SPDX-License-Identifier: Apache-2.0
// A scene rendered from its boxes, without a volume file.
#include <cmath>

#include "tests/tools/programs.h"
#include "volcomp/view/image.h"
#include "volcomp/volume/vdb_io.h"

namespace volcomp {
namespace {

// At least one pixel wide everywhere, so that all of the picture is of one level.
constexpr const char* kVoxel = "voxel = 0.08";

class Boxes : public Programs {
protected:
    Image picture(const std::string& source, const std::string& more = "")
    {
        const Outcome rendered = run("render", "scene.toml " + source + " -o a.exr " + more);
        EXPECT_EQ(rendered.status, 0) << rendered.output;
        return readImage(path("a.exr"));
    }
    /// Of all densities over space.
    static double integralOf(const Volume& volume)
    {
        double sum = 0;
        for (const VolumePart& part : volume.parts)
            for (auto value = part.density->cbeginValueOn(); value; ++value)
                sum += double(*value) * std::pow(volume.voxelSize(), 3);
        return sum;
    }
    /// RMSE of the colours over the mean of b's.
    static double difference(const Image& a, const Image& b)
    {
        double squares = 0, sum = 0, count = 0;
        for (int y = 0; y < b.height; ++y)
            for (int x = 0; x < b.width; ++x)
                for (int c = 0; c < 3; ++c, ++count) {
                    const double d = double(a.pixel(x, y)[c]) - double(b.pixel(x, y)[c]);
                    squares += d * d;
                    sum += double(b.pixel(x, y)[c]);
                }
        return std::sqrt(squares * count) / sum;
    }
};

} // namespace

// The file has its densities as half floats.
TEST_F(Boxes, ShowWhatTheComposedFileShows)
{
    writeSceneWith("voxel = 0.02", kVoxel);
    bakeAndCompose();
    for (const std::string shadows : {"exact", "sweep", "none"}) {
        const std::string more = "--samples 2 --shadows " + shadows;
        const Image file = picture("--volume volume.vdb", more),
                    boxes = picture("--boxes boxes", more);
        EXPECT_LT(difference(boxes, file), shadows == "sweep" ? 3e-3 : 5e-4) << shadows;
    }
}

TEST_F(Boxes, ACropAndAnyMemoryShowTheSame)
{
    writeSceneWith({{"voxel = 0.02", "voxel_pixels = 1"}, {"eye = ", "eye = [0, 0.6, 0.9]"}});
    ASSERT_EQ(bake().status, 0);
    const std::string more = "--samples 2 --scattering multiple";
    const Image whole = picture("--boxes boxes", more + " --stats a.json"),
                crop = picture("--boxes boxes", more + " --crop 11,9,20,13");
    for (int y = 0; y < 13; ++y)
        for (int x = 0; x < 20; ++x)
            for (int c = 0; c < 4; ++c)
                EXPECT_EQ(crop.pixel(x, y)[c], whole.pixel(x + 11, y + 9)[c]) << x << " " << y;
    const nlohmann::json stats = readJson("a.json");
    EXPECT_GT(stats["tiles"]["peak_bytes"], 1000);
    EXPECT_GT(stats["tiles"]["levels"].size(), 1u);
    // With little left for tiles beside the program itself, which takes as much as it takes.
    const double own = stats["tiles"]["process_peak_mb"], need = 45;
    const Image little =
        picture("--boxes boxes", more + " --max-memory " + std::to_string(int(own + need)));
    EXPECT_EQ(little.pixels, whole.pixels);
}

// More pixels, finer voxels.
TEST_F(Boxes, VoxelsFollowThePicture)
{
    writeSceneWith({{"voxel = 0.02", "voxel_pixels = 0.7"}, {"voxel = 0.01", "voxel = 0.001"}});
    ASSERT_EQ(bake().status, 0);
    picture("--boxes boxes", "--stats small.json --samples 1");
    picture("--boxes boxes", "--stats large.json --samples 1 --size 96x64");
    const double small = readJson("small.json")["tiles"]["levels"][0]["voxel_m"],
                 large = readJson("large.json")["tiles"]["levels"][0]["voxel_m"];
    EXPECT_NEAR(small, 2 * large, 1e-6);
    // The nearest corner of the tufts is about 1.9 m away; pixels are 2 tan(20 degrees) / 48 of
    // the distance wide.
    EXPECT_NEAR(small, 0.7 * 2 * std::tan(20 * M_PI / 180) / 48 * 1.9, 0.2 * small);
}

// A picture of a flight is the picture of its camera: what is left of the one before changes
// nothing.
TEST_F(Boxes, AFlightShowsWhatEachCameraShows)
{
    writeSceneWith("voxel = 0.02", kVoxel); // the same voxels for all cameras
    ASSERT_EQ(bake().status, 0);
    write("cameras.txt", "# eye, target, degrees\n0 1.5 2.0 0 0 0\n\n0.3,1.2,1.5, 0,0.1,0, 35\n");
    const Outcome flown = run("render",
                              "scene.toml --boxes boxes --samples 2 --cameras cameras.txt "
                              "-o flight.##.exr --stats a.json");
    ASSERT_EQ(flown.status, 0) << flown.output;
    EXPECT_EQ(readImage(path("flight.01.exr")).pixels,
              picture("--boxes boxes", "--samples 2").pixels);
    std::string text = read("scene.toml");
    text.replace(text.find("eye = [0, 1.5, 2.0]\ntarget = [0, 0, 0]"), 39,
                 "eye = [0.3, 1.2, 1.5]\ntarget = [0, 0.1, 0]\nfield_of_view_degrees = 35\n");
    write("scene.toml", text);
    EXPECT_EQ(readImage(path("flight.02.exr")).pixels,
              picture("--boxes boxes", "--samples 2").pixels);
    const nlohmann::json frames = readJson("a.json")["frames"];
    ASSERT_EQ(frames.size(), 2u);
    EXPECT_LT(frames[1]["tiles_made"], frames[0]["tiles_made"]);
    expectFailure(run("render", "scene.toml --boxes boxes --cameras cameras.txt -o b.exr"),
                  {"expected a # in the name"}, "b.exr");
    write("cameras.txt", "0 1 2 0 0\n");
    expectFailure(run("render", "scene.toml --boxes boxes --cameras cameras.txt -o b.#.exr"),
                  {"cameras.txt", "line 1", "eye and target", "5 numbers"}, "b.1.exr");
    write("cameras.txt", "0 1 2 0 0 0 forty\n");
    expectFailure(run("render", "scene.toml --boxes boxes --cameras cameras.txt -o b.#.exr"),
                  {"line 1", "'forty'"}, "b.1.exr");
    write("cameras.txt", "1 1 1 1 1 1\n");
    expectFailure(run("render", "scene.toml --boxes boxes --cameras cameras.txt -o b.#.exr"),
                  {"line 1"}, "b.1.exr");
}

TEST_F(Boxes, FailWithOneMessage)
{
    expectFailure(run("render", "scene.toml --boxes boxes -o a.exr"),
                  {"the box 'tuft', variant 1", "Run volcomp-bake first"}, "a.exr");
    ASSERT_EQ(bake().status, 0);
    expectFailure(run("render", "scene.toml --boxes boxes -o a.exr --max-memory 1"),
                  {"--max-memory: expected at least", "found 1 MB"}, "a.exr");
    expectFailure(run("render", "scene.toml --boxes boxes -o a.exr --filter trilinear"),
                  {"filter: expected \"box\"", "volcomp-compose"}, "a.exr");
    writeSceneWith("length = 0.2", "length = 0.3");
    expectFailure(run("render", "scene.toml --boxes boxes -o a.exr"),
                  {"box.tuft.level.1.length was 0.2 and is 0.3 now"}, "a.exr");
    EXPECT_EQ(run("render", "scene.toml --boxes boxes -o a.exr --allow-stale").status, 0);
}

TEST_F(Boxes, ALayerWithoutBoxesIsWell)
{
    writeSceneWith("density = 60", "density = 0");
    ASSERT_EQ(bake().status, 0);
    const Image image = picture("--boxes boxes", "--samples 1");
    EXPECT_EQ(image.width, 48);
}

// Volumes for other programs: each twice as coarse as the one before, and together what the whole
// volume of the finest voxels has.
TEST_F(Boxes, AreComposedForACameraToo)
{
    openvdb::initialize();
    writeSceneWith({{"voxel = 0.02", "voxel_pixels = 1\nkeep = \"integral\""},
                    {"eye = ", "eye = [0, 0.6, 0.9]"}});
    ASSERT_EQ(bake().status, 0);
    const Outcome made =
        run("compose", "scene.toml --boxes boxes --camera -o view.vdb --stats view.json");
    ASSERT_EQ(made.status, 0) << made.output;
    EXPECT_FALSE(exists("view.vdb"));
    const nlohmann::json levels = readJson("view.json")["levels"];
    ASSERT_GE(levels.size(), 2u);
    double before = 0, sum = 0;
    for (std::size_t n = 0; n < levels.size(); ++n) {
        const std::string name = "view.level" + std::to_string(n) + ".vdb";
        ASSERT_EQ(exists(name), levels[n]["voxels"] > 0);
        if (!exists(name)) continue;
        const Volume volume = readVolume(path(name));
        const double voxel = volume.voxelSize();
        EXPECT_DOUBLE_EQ(voxel, levels[n]["voxel_m"]);
        if (before > 0) {
            EXPECT_NEAR(voxel, 2 * before, 1e-9);
        }
        before = voxel;
        sum += integralOf(volume);
    }
    const Outcome whole = run(
        "compose", "scene.toml --boxes boxes -o all.vdb --voxel " + levels[0]["voxel_m"].dump());
    ASSERT_EQ(whole.status, 0) << whole.output;
    const double expected = integralOf(readVolume(path("all.vdb")));
    EXPECT_NEAR(sum, expected, 0.01 * expected);
}

} // namespace volcomp
