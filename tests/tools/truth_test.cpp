// SPDX-License-Identifier: Apache-2.0
// The exact picture against what can be computed by hand.
#include <cmath>
#include <fstream>
#include <string>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"
#include "tools/shared/picture_error.h"
#include "tools/truth/exact_picture.h"
#include "volcomp/base/interval.h"
#include "volcomp/base/random.h"
#include "volcomp/base/vec.h"

namespace volcomp {
namespace {

/// One box with one strand or leaf, and what is around it.
struct OneStrand {
    std::string camera = "eye = [0.0, 0.5, 3.0]\ntarget = [0.0, 0.5, 0.0]\nwidth = 1.0";
    std::string light_direction = "[0.0, -0.5, -0.8660254037844386]";
    std::string kind = "fibre";
    std::string level = "length = 1.0\nradius = 0.05\ntaper = 0.0\nsegments = 4";
    std::string more, layer;
    int width = 100, height = 60;
};

/// The scene of `setup`, colour 0.5, alpha 0.8, and no specular light.
ExactScene sceneOf(const OneStrand& setup)
{
    const TemporaryFolder folder;
    const auto file = folder.path() / "scene.toml";
    std::ofstream(file)
        << "[camera]\nprojection = \"orthographic\"\n"
        << setup.camera << "\n[render]\nwidth = " << setup.width << "\nheight = " << setup.height
        << "\n[[light]]\nstrength = [2.0, 1.0, 0.5]\ndirection = " << setup.light_direction
        << "\n[material.m]\nkind = \"" << setup.kind << "\"\nalpha = 0.8\nbeta = 0.0\n"
        << "[box.one]\nmaterial = \"m\"\nvariants = 1\n[[box.one.level]]\nname = \"stem\"\n"
        << setup.level
        << "\ncolour_root = [0.5, 0.5, 0.5]\ncolour_tip = [0.5, 0.5, 0.5]\n"
           "[surface.ground]\nground = [1e-4, 1e-4]\n"
           "[[layer]]\nbox = \"one\"\nsurface = \"ground\"\ndensity = 1e8\n"
        << setup.layer << "\n"
        << setup.more;
    return makeExactScene(readScene(file));
}

Image pictureOf(const ExactScene& scene, double solid_radius = kInfinity, int samples = 64,
                std::uint64_t seed = 1)
{
    const EmbreeScene embree(scene, solid_radius);
    ExactParams params;
    params.samples = samples;
    params.seed = seed;
    return exactPicture(scene, embree, params);
}

double mean(const Image& image, int channel)
{
    double sum = 0;
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) sum += image.pixel(x, y)[channel];
    return sum / (double(image.width) * image.height);
}

double most(const Image& image, int channel)
{
    double value = 0;
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x)
            value = std::max(value, double(image.pixel(x, y)[channel]));
    return value;
}

TEST(Truth, AStrandCoversItsWidthAndShowsItsTangentsLight)
{
    const Image image = pictureOf(sceneOf({}));
    // An upright strand 0.1 thick before a camera of width 1.
    EXPECT_NEAR(mean(image, 3), 0.1, 2e-4);
    // alpha c sin(t, L) times the light, everywhere on it.
    EXPECT_NEAR(most(image, 0), 0.8 * 0.5 * std::sqrt(0.75) * 2, 1e-5);
    EXPECT_NEAR(mean(image, 0), 0.1 * 0.8 * 0.5 * std::sqrt(0.75) * 2, 2e-4);
    EXPECT_NEAR(mean(image, 1) / mean(image, 0), 0.5, 1e-6);
}

TEST(Truth, AThinFibreDoesNotShadeItselfAndASolidOneDoes)
{
    OneStrand setup;
    setup.light_direction = "[1.0, 0.0, 0.0]"; // from the side, seen from the front
    const ExactScene scene = sceneOf(setup);
    EXPECT_NEAR(mean(pictureOf(scene), 0), 0.1 * 0.8 * 0.5 * 2, 2e-4);
    EXPECT_NEAR(mean(pictureOf(scene, 0.01), 0), 0.05 * 0.8 * 0.5 * 2, 1e-3);
}

TEST(Truth, AFlatLeafShowsItsProjectedAreaAndItsNormalsLight)
{
    OneStrand setup;
    setup.kind = "surface";
    setup.level = "outline = \"ellipse\"\nlength = 0.5\nwidth_ratio = 0.2\nsegments = 12";
    setup.camera = "eye = [3.0, 0.25, 0.0]\ntarget = [0.0, 0.25, 0.0]\nwidth = 1.0";
    setup.light_direction = "[-0.8660254037844386, -0.5, 0.0]";
    const Image image = pictureOf(sceneOf(setup));
    // The leaf stands upright, turned about its axis at random: N.L is sqrt(3/4) N.V.
    const double facing = most(image, 1) / (0.8 * 0.5 * std::sqrt(0.75));
    EXPECT_GT(facing, 0.05);
    EXPECT_NEAR(mean(image, 3) * 0.6, kPi / 4 * 0.5 * 0.1 * facing, 5e-4);
}

/// A square of triangles that a picture halves, in front of the camera.
TEST(Truth, ATriangleIsCutOutAndShowsItsTexture)
{
    const TemporaryFolder folder;
    const auto mesh = folder.write("card.obj",
                                   "v -0.4 0.1 0\nv 0.4 0.1 0\nv 0.4 0.9 0\nv -0.4 0.9 0\n"
                                   "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n");
    std::string mask = "P5 64 1 255\n";
    for (int i = 0; i < 64; ++i) mask += static_cast<char>(i < 16 ? 0 : 255);
    const auto alpha = folder.write("mask.pgm", mask);
    const auto texture = folder.write("red.ppm", "P6 1 1 255\n\xff" + std::string(2, '\0'));
    const auto scene = folder.write(
        "scene.toml",
        "[camera]\nprojection = \"orthographic\"\neye = [0, 0.5, 3]\ntarget = [0, 0.5, 0]\n"
        "width = 1\n[render]\nwidth = 80\nheight = 80\n[[light]]\ndirection = [0, 0, -1]\n"
        "[material.m]\nkind = \"surface\"\nalpha = 0.8\nbeta = 0\n"
        "[box.card]\nmaterial = \"m\"\nmesh = \""
            + mesh.string() + "\"\n[[box.card.mesh_material]]\ntexture = \"" + texture.string()
            + "\"\nalpha = \"" + alpha.string()
            + "\"\ncolour = [0.5, 1, 1]\n[surface.ground]\nground = [1, 1]\n"
              "[[place]]\nbox = \"card\"\nposition = [0, 0, 0]\n");
    const Image image = pictureOf(makeExactScene(readScene(scene)));
    const double covered = 0.8 * 0.8 * 0.75;
    EXPECT_NEAR(mean(image, 3), covered, 0.005);
    EXPECT_NEAR(mean(image, 0), covered * 0.8 * 0.5, 0.003);
    EXPECT_EQ(mean(image, 1), 0);
}

TEST(Truth, ASkinIsLitAsAWallIsAndAStrandThrowsItsShadow)
{
    OneStrand setup;
    setup.camera =
        "eye = [0.0, 3.0, 0.0]\ntarget = [0.0, 0.0, 0.0]\nup = [0.0, 0.0, -1.0]\nwidth = 2.0";
    setup.light_direction = "[0.5, -0.7071067811865476, 0.5]";
    setup.level =
        "length = 0.5\nradius = 0.02\ntaper = 0.0\nsegments = 4\nangle_degrees = [90, 90]";
    setup.layer = "offset = 0.4";
    setup.width = setup.height = 100;
    setup.more =
        "[material.soil]\nkind = \"surface\"\nalpha = 0.5\nbeta = 0.0\n"
        "[surface.plane]\nground = [4.0, 4.0]\nskin = \"soil\"\nskin_colour = [0.1, 1.0, 1.0]\n"
        "[[layer]]\nbox = \"one\"\nsurface = \"plane\"\ndensity = 0\nname = \"none\"";
    const Image image = pictureOf(sceneOf(setup));
    // alpha c cos(45 degrees) times the light.
    const double red = 0.5 * 0.1 * std::sqrt(0.5) * 2, green = 0.5 * std::sqrt(0.5);
    EXPECT_NEAR(image.pixel(0, 0)[0], red, 1e-6);
    EXPECT_NEAR(image.pixel(0, 0)[1], green, 1e-6);
    // What the strand covers and what it shades, from the means of two colours. The strand shows
    // 0.8 0.5 s (2, 1, 0.5), with s = sin(t, L).
    double s = 0;
    for (int y = 0; y < 100; ++y)
        for (int x = 0; x < 100; ++x)
            if (const float* p = image.pixel(x, y); p[0] > p[1]) s = std::max(s, p[0] / 0.8);
    const double a = 0.8 * s - red, b = -red, r = mean(image, 0) - red;
    const double c = 0.4 * s - green, d = -green, g = mean(image, 1) - green;
    const double covered = 4 * (r * d - b * g) / (a * d - b * c),
                 shaded = 4 * (a * g - c * r) / (a * d - b * c);
    const double ends = kPi * 0.02 * 0.02; // two half balls
    EXPECT_NEAR(covered, 2 * 0.02 * 0.5 + ends, 3e-4);
    EXPECT_NEAR(shaded, (2 * 0.02 * 0.5 * s + ends) / std::sqrt(0.5), 4e-4);
}

TEST(Truth, TheBytesAreTheSameForAnyNumberOfThreads)
{
    OneStrand setup; // whose edges run through pixels
    setup.camera = "eye = [0.3, 0.5, 3.0]\ntarget = [0.0, 0.5, 0.0]\nwidth = 0.97";
    const ExactScene scene = sceneOf(setup);
    Image one;
    {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
        one = pictureOf(scene, kInfinity, 4);
    }
    EXPECT_EQ(one.pixels, pictureOf(scene, kInfinity, 4).pixels);
    EXPECT_NE(one.pixels, pictureOf(scene, kInfinity, 4, 2).pixels);
}

TEST(Truth, WithoutHalvesAllSamplesAreOneGridThatHasLessNoise)
{
    OneStrand setup;
    setup.camera = "eye = [0.3, 0.5, 3.0]\ntarget = [0.0, 0.5, 0.0]\nwidth = 0.97";
    const ExactScene scene = sceneOf(setup);
    const EmbreeScene embree(scene);
    ExactParams params;
    params.samples = 1024;
    const Image exact = exactPicture(scene, embree, params);
    params.samples = 16;
    params.seed = 2;
    const PictureError in_halves = pictureError(exactPicture(scene, embree, params), exact);
    params.halves = false;
    const Image image = exactPicture(scene, embree, params);
    EXPECT_EQ(image.channels, (std::vector<std::string>{"R", "G", "B", "A"}));
    const PictureError whole = pictureError(image, exact);
    // 16 cells, or two grids of 4 cells and 4 places at random in each half.
    EXPECT_GT(whole.alpha_rmse, 0);
    EXPECT_LT(whole.alpha_rmse, 0.8 * in_halves.alpha_rmse);
    EXPECT_NEAR(whole.alpha_bias, 0, 0.01);
    params.samples = 1;
    EXPECT_GT(pictureError(exactPicture(scene, embree, params), exact).alpha_rmse,
              3 * whole.alpha_rmse);
    params.samples = 0;
    EXPECT_NE(messageOf([&] { exactPicture(scene, embree, params); }).find("at least 1 sample"),
              std::string::npos);
}

/// An exact picture of noise around `value`, whose halves are independent.
Image noisy(double value, double noise, std::uint64_t seed)
{
    Image image;
    image.width = 64, image.height = 48;
    image.channels = {"R", "G", "B", "A", "half.R", "half.G", "half.B", "half.A"};
    Random random(seed);
    for (int i = 0; i < image.width * image.height; ++i) {
        float half[2][4];
        for (auto& h : half)
            for (float& x : h) x = float(value + noise * random.normal());
        for (int c = 0; c < 4; ++c) image.pixels.push_back(0.5f * (half[0][c] + half[1][c]));
        for (const float x : half[0]) image.pixels.push_back(x);
    }
    return image;
}

TEST(PictureError, LeavesTheNoiseOfTheExactPictureOut)
{
    // A picture that is 10 % too bright everywhere, and noise of 30 % in each half of the exact
    // one.
    const Image exact = noisy(1, 0.3, 5);
    Image picture = exact;
    for (float& x : picture.pixels) x = 1.1f;
    const PictureError e = pictureError(picture, exact);
    EXPECT_NEAR(e.mean, 1, 0.01);
    EXPECT_NEAR(e.bias, 0.1, 0.01);
    // One product has the deviation 0.09 + 0.1 0.3 sqrt(2), the mean of 9216 of them 0.0012.
    EXPECT_NEAR(e.rmse * e.rmse, 0.01, 0.004);
    EXPECT_NEAR(e.block_rmse, 0.1, 0.01);
    EXPECT_NEAR(e.alpha_bias, 0.1, 0.01);
}

TEST(PictureError, SaysWhatDoesNotFit)
{
    const Image exact = noisy(1, 0, 1);
    Image other = exact;
    EXPECT_EQ(pictureError(exact, exact).rmse, 0);
    other.channels[2] = "X";
    EXPECT_NE(messageOf([&] { pictureError(other, exact); }).find("channel 'B'"),
              std::string::npos);
    other = exact;
    other.width = 48, other.height = 64;
    EXPECT_NE(messageOf([&] { pictureError(other, exact); }).find("64 x 48"), std::string::npos);
    EXPECT_NE(messageOf([&] { pictureError(exact, noisy(0, 0, 1)); }).find("black"),
              std::string::npos);
}

} // namespace
} // namespace volcomp
