// SPDX-License-Identifier: Apache-2.0
// Strands of a file from the scene to the picture: as a groom and as tufts of a box.
#include <cmath>
#include <sstream>

#include "tests/tools/programs.h"
#include "volcomp/base/random.h"
#include "volcomp/view/image.h"
#include "volcomp/volume/vdb_io.h"

namespace volcomp {
namespace {

class Grooms : public Programs {
protected:
    /// Upright strands of two segments, 0.4 m long, on a square of 1 m, as OBJ; `at` is added.
    static std::string strands(int count, const std::string& at = "0")
    {
        std::ostringstream text;
        text.precision(15);
        for (int s = 0; s < count; ++s) {
            Random random(hashKey(11, std::uint64_t(s)));
            const double x = random.uniform() - 0.5, z = random.uniform() - 0.5;
            for (const double y : {0.0, 0.2, 0.4})
                text << "v " << x + std::stod(at) + 0.2 * y << ' ' << y << ' ' << z << '\n';
            text << "l -3 -2 -1\n";
        }
        return text.str();
    }
    void writeGroom(const std::string& more)
    {
        write("strands.obj", strands(300));
        write("scene.toml", R"(
[material.fur]
kind = "fibre"
[groom.hair]
curves = "strands.obj"
material = "fur"
width = 0.008
pieces = 5
colour_root = [1, 0.5, 0.2]
[camera]
eye = [0, 1.2, 2.0]
target = [0, 0.15, 0]
field_of_view_degrees = 40
[[light]]
direction = [-1, -2, -1]
[render]
width = 96
height = 64
samples = 8
)" + more);
    }
    /// The sum of the densities times the volume of a voxel, of all parts, metres squared.
    double amount(const std::string& file) const
    {
        openvdb::initialize();
        const Volume volume = readVolume(path(file));
        double sum = 0;
        for (const VolumePart& part : volume.parts)
            for (auto voxel = part.density->cbeginValueOn(); voxel; ++voxel) sum += double(*voxel);
        return sum * std::pow(volume.voxelSize(), 3);
    }
    /// What volcomp-truth says of a.exr.
    nlohmann::json errorOf(const std::string& scene)
    {
        const Outcome traced = run("truth", scene + " --samples 64 --compare a.exr --stats e.json");
        EXPECT_EQ(traced.status, 0) << traced.output;
        return readJson("e.json")["error"];
    }
};

} // namespace

// Thin strands in voxels that they rarely fill: nearly all density is pi/4 of width times length.
TEST_F(Grooms, AreBakedInPiecesAndComposedWithAllOfTheirStrands)
{
    writeGroom("[compose]\nvoxel = 0.02\nkeep = \"integral\"\n");
    const Outcome baked = bake();
    ASSERT_EQ(baked.status, 0) << baked.output;
    double sum = 0;
    for (int k = 1; k <= 5; ++k) sum += amount("boxes/hair_" + std::to_string(k) + ".vdb");
    EXPECT_FALSE(exists("boxes/hair_6.vdb"));
    const double length = 0.4 * std::sqrt(1 + 0.04), wanted = 300 * length * 0.008 * M_PI / 4;
    EXPECT_NEAR(sum / wanted, 1.2, 0.2); // baking.md: 1 to 1.18, and the logarithm
    const Outcome composed = compose("--placements p.json");
    ASSERT_EQ(composed.status, 0) << composed.output;
    EXPECT_NEAR(amount("volume.vdb") / sum, 1, 0.02);
    EXPECT_EQ(readJson("p.json").size(), 5u);
    EXPECT_EQ(readJson("p.json")[0]["layer"], "hair");
    EXPECT_EQ(readJson("p.json")[4]["box"], "hair_5");
}

TEST_F(Grooms, LookLikeTheirStrands)
{
    writeGroom("shadows = \"exact\"\n");
    ASSERT_EQ(bake().status, 0);
    const Outcome rendered = run("render", "scene.toml --boxes boxes -o a.exr");
    ASSERT_EQ(rendered.status, 0) << rendered.output;
    const nlohmann::json error = errorOf("scene.toml");
    EXPECT_LT(std::abs(error["alpha_bias"].get<double>()), 0.02);
    EXPECT_LT(std::abs(error["bias"].get<double>()), 0.08);
}

TEST_F(Grooms, KeepTheirShapeFarFromTheOrigin)
{
    writeGroom("shadows = \"none\"\n");
    ASSERT_EQ(bake().status, 0);
    ASSERT_EQ(run("render", "scene.toml --boxes boxes -o a.exr").status, 0);
    std::string scene = read("scene.toml");
    write("strands.obj", strands(300, "1000000"));
    for (const auto& [from, to] :
         {std::pair<std::string, std::string>{"eye = [0,", "eye = [1000000,"},
          {"target = [0,", "target = [1000000,"}})
        scene.replace(scene.find(from), from.size(), to);
    write("far.toml", scene);
    ASSERT_EQ(run("bake", "far.toml -o far").status, 0);
    ASSERT_EQ(run("render", "far.toml --boxes far -o b.exr").status, 0);
    const Image near = readImage(path("a.exr")), there = readImage(path("b.exr"));
    double squares = 0, sum = 0;
    for (int y = 0; y < near.height; ++y)
        for (int x = 0; x < near.width; ++x) {
            const double a = double(near.pixel(x, y)[3]), b = double(there.pixel(x, y)[3]);
            squares += (a - b) * (a - b);
            sum += a;
        }
    // The voxels lie elsewhere on strands that are half a pixel wide; with points in float it
    // is 1.5.
    EXPECT_LT(std::sqrt(squares * near.width * near.height) / sum, 0.2);
    EXPECT_GT(sum, 100);
}

TEST_F(Grooms, ChangesOfTheStrandsAreNoticed)
{
    writeGroom("[compose]\nvoxel = 0.04\n");
    ASSERT_EQ(bake().status, 0);
    write("strands.obj", strands(301));
    const Outcome stale = compose();
    EXPECT_EQ(stale.status, 1);
    EXPECT_NE(stale.output.find("groom.hair.curves content has changed"), std::string::npos)
        << stale.output;
}

TEST_F(Grooms, StandBesideBoxesThatAreCutFromCurvesToo)
{
    write("strands.obj", strands(60));
    std::string text = kScene;
    const auto first = text.find("voxel = 0.01"), end = text.find("[surface.ground]");
    text.replace(first, end - first,
                 "voxel = 0.01\ncurves = \"strands.obj\"\nscale = 0.1\nwidth = 0.004\n\n"
                 "[groom.hair]\ncurves = \"strands.obj\"\nmaterial = \"fur\"\nwidth = 0.008\n"
                 "pieces = 2\n\n");
    write("scene.toml", text);
    bakeAndCompose();
    EXPECT_TRUE(exists("boxes/tuft_2.vdb"));
    EXPECT_TRUE(exists("boxes/hair_2.vdb"));
    ASSERT_EQ(run("render", "scene.toml --boxes boxes -o a.exr").status, 0);
    const nlohmann::json error = errorOf("scene.toml");
    EXPECT_LT(std::abs(error["alpha_bias"].get<double>()), 0.08); // the skin is voxels here
}

TEST_F(Grooms, MistakesAreExplained)
{
    writeGroom("");
    std::string scene = read("scene.toml");
    write("bad.toml", scene + "[box.hair]\nmaterial = 'fur'\nlevel = [{length = 1, radius = 1}]\n");
    expectFailure(run("bake", "bad.toml -o none"), {"groom.hair", "whose name no box has"}, "none");
    write("bad.toml", scene + "[box.a]\nmaterial = 'fur'\nwidth = 1\nlevel = [{}]\n");
    expectFailure(run("bake", "bad.toml -o none"), {"unknown key", "width"}, "none");
    write("bad.toml",
          scene + "[box.a]\nmaterial = 'fur'\ncurves = 'strands.obj'\nlevel = [{length = 1}]\n");
    expectFailure(run("bake", "bad.toml -o none"), {"or one of 'curves', 'mesh' and 'files'"},
                  "none");
    write("strands.obj", "v 0 0 0\n");
    expectFailure(run("compose", "scene.toml --boxes none -o v.vdb"), {"hair_1.vdb"}, "v.vdb");
}

} // namespace volcomp
