// SPDX-License-Identifier: Apache-2.0
// volcomp-bake and volcomp-compose run as processes: their options.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <regex>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>
#include <openvdb/openvdb.h>

#include "volcomp/base/vec.h"
#include "volcomp/view/image.h"
#include "volcomp/volume/packed_volume.h"
#include "volcomp/volume/vdb_io.h"
#include "tests/tools/programs.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;

std::set<std::string> gridNames(const fs::path& volume)
{
    openvdb::initialize();
    openvdb::io::File file(volume.string());
    file.open();
    std::set<std::string> names;
    for (auto it = file.beginName(); it != file.endName(); ++it) names.insert(*it);
    return names;
}

/// Whether two files hold the same voxels; what they say of their origin may differ.
bool haveSameVoxels(const fs::path& a, const fs::path& b)
{
    openvdb::initialize();
    const PackedVolume x = pack(readVolume(a)), y = pack(readVolume(b));
    if (x.parts.size() != y.parts.size()) return false;
    for (std::size_t p = 0; p < x.parts.size(); ++p) {
        const PackedPart &one = x.parts[p], &other = y.parts[p];
        if (one.blocks.size() != other.blocks.size() || one.has_colour != other.has_colour
            || one.has_direction != other.has_direction)
            return false;
        const std::size_t bytes = one.voxelBytes();
        for (std::size_t i = 0; i < one.blocks.size(); ++i) {
            const PackedBlock &v = one.blocks[i], &w = other.blocks[i];
            if (v.origin != w.origin || v.mask != w.mask
                || std::memcmp(v.values, w.values, v.count * bytes) != 0)
                return false;
        }
    }
    return true;
}

TEST_F(Programs, SurfacesAreLeftOut)
{
    ASSERT_EQ(bake().status, 0);
    expectFailure(compose("--leave-out grund"), {"--leave-out", "(ground)", "'grund'"},
                  "volume.vdb");
    writeSceneWith(
        "[[layer]]",
        "[surface.wall]\nmesh = \"ground.obj\"\nskin = \"skin\"\nskin_as = \"voxels\"\n\n[[layer]]\nsurface = \"ground\"");
    ASSERT_EQ(compose("--stats with.json").status, 0);
    ASSERT_EQ(compose("--stats without.json --leave-out ground").status, 0);
    const auto with = readJson("with.json"), without = readJson("without.json");
    EXPECT_EQ(with["surfaces"].size(), 2u);
    EXPECT_TRUE(without["surfaces"].contains("wall") && without["surfaces"].size() == 1);
    EXPECT_GT(with["placements"], 10);
    EXPECT_EQ(without["placements"], 0);
    EXPECT_GT(without["active_voxels"], 100);
}

// What is left of a scene without its second surface is the scene that never had one.
TEST_F(Programs, ASceneWithoutASurfaceIsTheSceneThatHasNone)
{
    bakeAndCompose();
    fs::rename(path("volume.vdb"), path("one.vdb"));
    writeSceneWith(
        "[[layer]]",
        "[surface.wall]\nmesh = \"ground.obj\"\nskin = \"skin\"\nskin_as = \"voxels\"\ntranslate = [0, 0.5, 0]\n\n"
        "[[layer]]\nsurface = \"ground\"");
    ASSERT_EQ(compose("--leave-out wall").status, 0);
    EXPECT_TRUE(haveSameVoxels(path("volume.vdb"), path("one.vdb")));
    ASSERT_EQ(compose().status, 0);
    EXPECT_FALSE(haveSameVoxels(path("volume.vdb"), path("one.vdb")));
}

TEST_F(Programs, OnlyTheNamedBoxesAreBaked)
{
    writeSceneWith(
        "[surface.ground]",
        "[box.blade]\nmaterial = \"fur\"\nvoxel = 0.01\n\n[[box.blade.level]]\nlength = 0.1\n"
        "radius = 0.004\n\n[surface.ground]");
    ASSERT_EQ(run("bake", "scene.toml -o all").status, 0);
    ASSERT_EQ(run("bake", "scene.toml -o some --box blade").status, 0);
    EXPECT_TRUE(exists("all/tuft_1.vdb") && exists("all/tuft_2.vdb") && exists("all/blade_1.vdb"));
    EXPECT_TRUE(exists("some/blade_1.vdb"));
    EXPECT_FALSE(exists("some/tuft_1.vdb"));
    EXPECT_TRUE(readBody("some/blade_1.vdb") == readBody("all/blade_1.vdb"));
    expectFailure(run("bake", "scene.toml -o none --box blad"), {"scene.toml", "[box.blad]"},
                  "none");
}

// The refusal advises a voxel size, and that one fits.
TEST_F(Programs, AVolumeAboveTheMemoryIsRefusedWithAVoxelThatFits)
{
    bakeAndCompose();
    ASSERT_EQ(compose("--stats all.json").status, 0);
    const double needed = readJson("all.json")["estimate"]["mb"];
    fs::remove(path("volume.vdb"));
    for (const double part : {0.9, 0.5, 0.2}) {
        const std::string limit = "--max-memory " + std::to_string(part * needed);
        const Outcome refused = compose(limit);
        expectFailure(refused, {"scene.toml", "--max-memory", "instead of 0.02 m would fit"},
                      "volume.vdb");
        std::smatch advice;
        ASSERT_TRUE(std::regex_search(refused.output, advice,
                                      std::regex("A voxel of ([0-9.e-]+) m instead of")))
            << refused.output;
        EXPECT_GT(std::stod(advice[1]), 0.02);
        const Outcome fits = compose(limit + " --voxel " + advice[1].str() + " --stats fits.json");
        ASSERT_EQ(fits.status, 0) << fits.output;
        EXPECT_LE(readJson("fits.json")["estimate"]["mb"], part * needed);
        fs::remove(path("volume.vdb"));
    }
    const Outcome all = compose("--max-memory " + std::to_string(1.01 * needed));
    EXPECT_EQ(all.status, 0) << all.output;
}

// Both names of the colour's grid are written by both programs, and read alike.
TEST_F(Programs, TheColourGridHasTheAskedName)
{
    writeSceneWith("segments",
                   "segments = 4\ncolour_root = [0.9, 0.1, 0]\ncolour_tip = [0, 0.2, 1]");
    for (const auto& [names, grid, other] :
         {std::tuple("houdini", "Cd", "color"), {"blender", "color", "Cd"}}) {
        const std::string option = std::string(" --grid-names ") + names;
        ASSERT_EQ(run("bake", "scene.toml -o boxes" + option).status, 0);
        ASSERT_EQ(compose(option).status, 0);
        const auto box = gridNames(path("boxes/tuft_1.vdb")), all = gridNames(path("volume.vdb"));
        EXPECT_TRUE(box.count(grid)) << names;
        EXPECT_FALSE(box.count(other)) << names;
        EXPECT_TRUE(all.count(grid + std::string("_fur"))) << names;
        EXPECT_FALSE(all.count(other + std::string("_fur"))) << names;
        ASSERT_EQ(render("-o " + std::string(names) + ".png").status, 0);
    }
    EXPECT_TRUE(read("houdini.png") == read("blender.png"));
}

// A pixel's edge is known for an orthographic camera, and for a perspective one that looks straight
// at a plane.
TEST_F(Programs, VoxelPixelsIsTheVoxelInPixels)
{
    ASSERT_EQ(bake().status, 0);
    struct Case {
        const char* camera;
        double pixel; ///< m
    };
    for (const Case& c :
         {Case{"eye = [0, 1.5, 2.0]\nprojection = \"orthographic\"\nwidth = 1.2", 1.2 / 48},
          Case{"eye = [0, 2, 0]\nup = [0, 0, -1]\nfield_of_view_degrees = 60",
               2 * 2 * std::tan(kPi / 6) / 48}}) {
        writeSceneWith({{"voxel = 0.02", "voxel_pixels = 0.75"}, {"eye", c.camera}});
        const Outcome outcome = compose("--stats compose.json");
        ASSERT_EQ(outcome.status, 0) << outcome.output;
        EXPECT_NEAR(readJson("compose.json")["voxel_m"], 0.75 * c.pixel, 1e-9) << c.camera;
        openvdb::initialize();
        openvdb::io::File file(path("volume.vdb").string());
        file.open();
        const auto grids = file.readAllGridMetadata();
        for (const auto& grid : *grids)
            EXPECT_NEAR(grid->voxelSize()[0], 0.75 * c.pixel, 1e-9) << grid->getName();
    }
}

} // namespace
} // namespace volcomp
