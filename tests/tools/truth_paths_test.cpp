// SPDX-License-Identifier: Apache-2.0
// More than one scattering, domes and soft lights against what can be computed by hand.
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "tests/support/mean_of_covered.h"
#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"
#include "tools/truth/exact_picture.h"
#include "volcomp/base/vec.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;

constexpr int kPixels = 24; ///< a side

/// A picture of `width` metres from `eye` to `target`, lit by what `text` says, which begins in
/// [render].
ExactScene sceneOf(const std::string& eye, const std::string& target, double width,
                   const std::string& text, const std::string& up = "[0.0, 0.0, -1.0]")
{
    const TemporaryFolder folder;
    const auto file = folder.path() / "scene.toml";
    std::ofstream(file) << "[camera]\nprojection = \"orthographic\"\nup = " << up
                        << "\neye = " << eye << "\ntarget = " << target << "\nwidth = " << width
                        << "\n[render]\nscattering = \"multiple\"\nwidth = " << kPixels
                        << "\nheight = " << kPixels << "\n"
                        << text;
    return makeExactScene(readScene(file));
}

Image pictureOf(const ExactScene& scene, int bounces, int samples = 64, std::uint64_t seed = 1)
{
    const EmbreeScene embree(scene);
    ExactParams params;
    params.samples = samples;
    params.seed = seed;
    params.paths.bounces = bounces;
    return exactPicture(scene, embree, params);
}

std::string material(const std::string& kind, double alpha, const std::string& more = {})
{
    return "[material.m]\nkind = \"" + kind + "\"\nalpha = " + std::to_string(alpha)
        + "\nbeta = 0.0\n" + more + "\n";
}

/// A metre with `density` of a box, whose one level is `level`, of colour `colour`.
std::string field(const std::string& level, int density, double colour = 1)
{
    const std::string c = std::to_string(colour), rgb = "[" + c + ", " + c + ", " + c + "]";
    return "[box.b]\nmaterial = \"m\"\nvariants = 1\n[[box.b.level]]\nname = \"l\"\n" + level
        + "\ncolour_root = " + rgb + "\ncolour_tip = " + rgb
        + "\n[surface.ground]\nground = [1.0, 1.0]\n[[layer]]\nbox = \"b\"\n"
          "surface = \"ground\"\ndensity = "
        + std::to_string(density) + "\n";
}

/// A dome that is not seen, as it would hide what is missing.
const char* const kWhiteDome =
    "[dome]\nkind = \"constant\"\ncolour = [1.0, 1.0, 1.0]\nvisible = false\n";

/// A skin that is the mesh of an OBJ file, of one grey.
std::string skin(const std::string& name, const fs::path& mesh, double colour)
{
    const std::string c = std::to_string(colour);
    return "[surface." + name + "]\nmesh = \"" + mesh.string() + "\"\nskin = \"m\"\nskin_colour = ["
        + c + ", " + c + ", " + c + "]\n";
}

/// A parallelogram from a corner along two sides.
fs::path plate(const fs::path& file, const Vec3d& corner, const Vec3d& u, const Vec3d& v)
{
    std::ofstream out(file);
    for (const Vec3d& p : {corner, Vec3d(corner + u), Vec3d(corner + u + v), Vec3d(corner + v)})
        out << "v " << p[0] << ' ' << p[1] << ' ' << p[2] << '\n';
    out << "f 1 2 3\nf 1 3 4\n";
    return file;
}

/// A ball of radius 1 around the origin.
fs::path ball(const fs::path& file)
{
    constexpr int kRows = 64, kColumns = 128;
    std::ofstream out(file);
    for (int r = 0; r <= kRows; ++r)
        for (int c = 0; c < kColumns; ++c) {
            const double t = kPi * r / kRows, p = 2 * kPi * c / kColumns;
            out << "v " << std::sin(t) * std::cos(p) << ' ' << std::cos(t) << ' '
                << std::sin(t) * std::sin(p) << '\n';
        }
    const auto at = [](int r, int c) { return 1 + r * kColumns + c % kColumns; };
    for (int r = 0; r < kRows; ++r)
        for (int c = 0; c < kColumns; ++c) {
            if (r > 0)
                out << "f " << at(r, c) << ' ' << at(r, c + 1) << ' ' << at(r + 1, c) << '\n';
            if (r + 1 < kRows)
                out << "f " << at(r, c + 1) << ' ' << at(r + 1, c + 1) << ' ' << at(r + 1, c)
                    << '\n';
        }
    return file;
}

std::string directional(const std::string& direction, const std::string& more = {})
{
    return "[[light]]\ndirection = " + direction + "\nstrength = [1.0, 1.0, 1.0]\n" + more + "\n";
}

const char* const kHairs = "length = 0.2\nradius = 0.003\nsegments = 4\nangle_degrees = [0, 50]";
const char* const kLeaves = "outline = \"ellipse\"\nlength = 0.2\nwidth_ratio = 0.3\nsegments = "
                            "6\nangle_degrees = [0, 80]";

TEST(TruthPaths, WhiteFurnace)
{
    const std::string camera = "[0.0, 3.0, 1.0]", target = "[0.0, 0.1, 0.0]";
    const auto furnace = [&](const std::string& text) {
        const Image image = pictureOf(sceneOf(camera, target, 0.8, text + kWhiteDome), 128);
        EXPECT_GT(meanOfCovered(image, 3), 0.99);
        return meanOfCovered(image);
    };
    EXPECT_NEAR(furnace(material("fibre", 1) + field(kHairs, 800)), 1, 0.003);
    EXPECT_NEAR(furnace(material("surface", 1) + field(kLeaves, 100)), 1, 0.003);
    EXPECT_NEAR(
        furnace(material("surface", 0.6, "transmission = [0.4, 0.4, 0.4]") + field(kLeaves, 100)),
        1, 0.003);
    const TemporaryFolder folder;
    const fs::path floor = plate(folder.path() / "a.obj", {-1, 0, -1}, {2, 0, 0}, {0, 0, 2}),
                   wall = plate(folder.path() / "b.obj", {-1, 0, -0.1}, {2, 0, 0}, {0, 0.5, 0.1});
    EXPECT_NEAR(furnace(material("surface", 1) + skin("a", floor, 1) + skin("b", wall, 1)), 1,
                0.003);
}

TEST(TruthPaths, AmbientLightIsTheConstantDomeAndIsOccluded)
{
    const std::string things = material("fibre", 0.5) + field(kHairs, 800);
    const std::string eye = "[0.0, 3.0, 1.0]", target = "[0.0, 0.1, 0.0]";
    const Image dome = pictureOf(sceneOf(eye, target, 0.8, things + kWhiteDome), 1);
    const Image ambient =
        pictureOf(sceneOf(eye, target, 0.8, "ambient = [1.0, 1.0, 1.0]\n" + things), 1);
    EXPECT_EQ(dome.pixels, ambient.pixels);
    EXPECT_LT(meanOfCovered(dome), 0.9 * 0.5);
}

TEST(TruthPaths, ADomeIsSeenByTheReflectionsOwnDistribution)
{
    // 1 straight up, 0 at the horizon, linear with the angle.
    const std::string dome = "[dome]\nkind = \"gradient\"\nzenith = [1.0, 1.0, 1.0]\n"
                             "horizon = [0.0, 0.0, 0.0]\nground = [0.0, 0.0, 0.0]\n"
                             "visible = false\n";
    // An upright strand: of 2 / pi sin^2 from the tangent, 1/4 - 1/pi^2.
    std::string strand = field("length = 1.0\nradius = 0.05\ntaper = 0.0\nsegments = 4", 1);
    strand.replace(strand.find("[1.0, 1.0]\n[[layer]]"), 10, "[1e-3, 1e-3]");
    strand.replace(strand.find("density = 1"), 11, "density = 1e6");
    const Image upright =
        pictureOf(sceneOf("[0.0, 0.5, 3.0]", "[0.0, 0.5, 0.0]", 0.5,
                          material("fibre", 0.8) + strand + dome, "[0.0, 1.0, 0.0]"),
                  1, 256);
    EXPECT_NEAR(meanOfCovered(upright), 0.8 * (0.25 - 1 / (kPi * kPi)), 0.001);
    // A floor, of the cosine: 1/2.
    const TemporaryFolder folder;
    const fs::path floor = plate(folder.path() / "a.obj", {-1, 0, -1}, {2, 0, 0}, {0, 0, 2});
    const Image flat = pictureOf(sceneOf("[0.0, 1.0, 0.0]", "[0.0, 0.0, 0.0]", 0.5,
                                         material("surface", 0.8) + skin("a", floor, 0.5) + dome),
                                 1);
    EXPECT_NEAR(meanOfCovered(flat), 0.8 * 0.5 * 0.5, 0.001);
}

TEST(TruthPaths, ABlackWallTakesHalfOfTheSky)
{
    const TemporaryFolder folder;
    const fs::path floor = plate(folder.path() / "a.obj", {-1, 0, -1}, {2, 0, 0}, {0, 0, 2}),
                   wall =
                       plate(folder.path() / "b.obj", {0.011, 0, -500}, {0, 1000, 0}, {0, 0, 1000});
    const Image image = pictureOf(
        sceneOf("[0.0, 1.0, 0.0]", "[0.0, 0.0, 0.0]", 0.02,
                material("surface", 0.8) + skin("a", floor, 1) + skin("b", wall, 0) + kWhiteDome),
        8, 256);
    EXPECT_NEAR(meanOfCovered(image), 0.5 * 0.8, 0.003);
}

TEST(TruthPaths, AVisibleDomeIsBehindEverything)
{
    const std::string dome = "background = [3.0, 3.0, 3.0]\n" + material("fibre", 1)
        + field(kHairs, 1)
        + "[dome]\nkind = \"gradient\"\nzenith = [0.0, 0.0, 0.0]\n"
          "horizon = [0.0, 0.0, 0.0]\nground = [0.0, 0.25, 0.5]\n";
    const auto corner = [&](const std::string& more) {
        const Image image =
            pictureOf(sceneOf("[2.0, 3.0, 0.0]", "[2.0, 0.0, 0.0]", 0.5, dome + more), 1, 2);
        return Vec3d(image.pixel(0, 0)[1], image.pixel(0, 0)[2], image.pixel(0, 0)[3]);
    };
    EXPECT_EQ(corner(""), Vec3d(0.25, 0.5, 1));
    EXPECT_EQ(corner("visible = false"), Vec3d(3, 3, 1));
    EXPECT_EQ(corner("strength = 0.0"), Vec3d(3, 3, 1));
}

TEST(TruthPaths, ABallWithALampInItsMiddleIsASeries)
{
    const TemporaryFolder folder;
    const ExactScene scene =
        sceneOf("[0.0, 0.0, 0.0]", "[0.0, -1.0, 0.0]", 0.5,
                material("surface", 1) + skin("a", ball(folder.path() / "a.obj"), 0.8)
                    + "[[light]]\nkind = \"point\"\nposition = [0.0, 0.0, 0.0]\nstrength = "
                      "[1.0, 1.0, 1.0]\n");
    for (const int bounces : {1, 2, 3, 8, 64})
        EXPECT_NEAR(meanOfCovered(pictureOf(scene, bounces)) / (4 * (1 - std::pow(0.8, bounces))),
                    1, 0.006)
            << bounces;
}

TEST(TruthPaths, AWallLightsTheFloorByItsFormFactor)
{
    const TemporaryFolder folder;
    const fs::path floor = plate(folder.path() / "a.obj", {0, 0, -1}, {1, 0, 0}, {0, 0, 2}),
                   wall = plate(folder.path() / "b.obj", {0, 0, -1}, {0, 0.5, 0}, {0, 0, 2});
    const ExactScene scene = sceneOf("[0.3, 1.0, 0.0]", "[0.3, 0.0, 0.0]", 0.02,
                                     material("surface", 1) + skin("a", floor, 0.5)
                                         + skin("b", wall, 0.9) + directional("[-1.0, 0.0, 0.0]"));
    EXPECT_EQ(meanOfCovered(pictureOf(scene, 1)), 0);
    // Of a rectangle of height h and width 2 w that stands upright, at the distance d.
    const double h = 0.5, w = 1, d = 0.3, far = std::sqrt(h * h + d * d),
                 factor = (std::atan(w / d) - d / far * std::atan(w / far)) / kPi;
    EXPECT_NEAR(meanOfCovered(pictureOf(scene, 2, 256)), 0.5 * 0.9 * factor, 0.001);
}

TEST(TruthPaths, LightComesThroughThinSheets)
{
    const TemporaryFolder folder;
    const std::string m = material("surface", 0.5, "transmission = [0.4, 0.2, 0.0]"),
                      sheet = skin(
                          "a", plate(folder.path() / "a.obj", {-1, 0, -1}, {2, 0, 0}, {0, 0, 2}),
                          0.5),
                      from_behind = directional("[0.6, 0.8, 0.0]");
    const auto shown = [&](const std::string& more, int bounces) {
        const Image image = pictureOf(
            sceneOf("[0.0, 1.0, 0.0]", "[0.0, 0.0, 0.0]", 0.2, m + sheet + more), bounces);
        return Vec3d(meanOfCovered(image, 0), meanOfCovered(image, 1), meanOfCovered(image, 2));
    };
    const Vec3d through = shown(from_behind, 1);
    EXPECT_NEAR(through[0], 0.4 * 0.5 * 0.8, 1e-6);
    EXPECT_NEAR(through[1], 0.2 * 0.5 * 0.8, 1e-6);
    EXPECT_EQ(through[2], 0);
    EXPECT_NEAR(shown(directional("[0.6, -0.8, 0.0]"), 1)[0], 0.5 * 0.5 * 0.8, 1e-6);
    // A second sheet close below: what that shows above goes through the first, and between the two
    // light goes to and fro: kappa^2 c^2 cos / (1 - (alpha c)^2).
    const Vec3d twice =
        shown(skin("b", plate(folder.path() / "b.obj", {-1, -1e-3, -1}, {2, 0, 0}, {0, 0, 2}), 0.5)
                  + from_behind,
              64);
    EXPECT_NEAR(twice[0] / (0.2 * 0.2 * 0.8 / (1 - 0.0625)), 1, 0.03);
    EXPECT_NEAR(twice[1] / (0.1 * 0.1 * 0.8 / (1 - 0.0625)), 1, 0.03);
}

TEST(TruthPaths, ALeafShowsLightFromBehind)
{
    // The mean of a level leaf's picture, lit from above or from below.
    const auto shown = [](const char* direction, const std::string& kappa) {
        std::string leaf = field("outline = \"ellipse\"\nlength = 0.2\nwidth_ratio = 0.3\n"
                                 "segments = 6\nangle_degrees = [90, 90]",
                                 1, 0.6);
        leaf.replace(leaf.find("[1.0, 1.0]\n[[layer]]"), 10, "[1e-3, 1e-3]");
        leaf.replace(leaf.find("density = 1"), 11, "density = 1e6");
        return meanOfCovered(pictureOf(sceneOf("[0.0, 3.0, 0.0]", "[0.0, 0.0, 0.0]", 0.4,
                                               material("surface", 0.5, "transmission = " + kappa)
                                                   + leaf + directional(direction)),
                                       1));
    };
    EXPECT_EQ(shown("[0.0, 1.0, 0.0]", "[0.0, 0.0, 0.0]"), 0);
    const double above = shown("[0.0, -1.0, 0.0]", "[0.25, 0.0, 0.0]");
    EXPECT_GT(above, 0.1);
    EXPECT_LT(above, 0.5 * 0.6 + 1e-6);
    EXPECT_NEAR(shown("[0.0, 1.0, 0.0]", "[0.25, 0.0, 0.0]") / above, 0.25 / 0.5, 1e-5);
}

TEST(TruthPaths, AnEdgeUnderASunHasTheDiscsPenumbra)
{
    const TemporaryFolder folder;
    const fs::path floor = plate(folder.path() / "a.obj", {-1, 0, -1}, {2, 0, 0}, {0, 0, 2}),
                   roof = plate(folder.path() / "b.obj", {-1, 0.5, -1}, {1, 0, 0}, {0, 0, 2});
    const double half = 5 * kDegree, reach = 0.5 * std::tan(half), width = 3 * reach;
    const Image image =
        pictureOf(sceneOf("[0.0, 0.4, 0.0]", "[0.0, 0.0, 0.0]", width,
                          material("surface", 1) + skin("a", floor, 1) + skin("b", roof, 1)
                              + directional("[0.0, -1.0, 0.0]", "disc_degrees = 10.0")),
                  1, 256);
    for (int x = 0; x < kPixels; ++x) {
        double sum = 0;
        for (int y = 0; y < kPixels; ++y) sum += image.pixel(x, y)[0];
        const double t = std::clamp(((x + 0.5) / kPixels - 0.5) * width / reach, -1.0, 1.0),
                     seen = 0.5 + (t * std::sqrt(1 - t * t) + std::asin(t)) / kPi;
        EXPECT_NEAR(sum / kPixels, seen, 0.012) << t;
    }
}

TEST(TruthPaths, ALampsSizeSoftensItsShadowAndKeepsItsStrength)
{
    const TemporaryFolder folder;
    const fs::path floor = plate(folder.path() / "a.obj", {-1, 0, -1}, {2, 0, 0}, {0, 0, 2}),
                   roof = plate(folder.path() / "b.obj", {-1, 0.5, -1}, {1, 0, 0}, {0, 0, 2});
    const auto shown = [&](const std::string& lamp, const std::string& eye, bool roofed) {
        const std::string target = "[" + eye + ", 0.0, 0.0]";
        return meanOfCovered(pictureOf(
            sceneOf(
                "[" + eye + ", 0.4, 0.0]", target, 0.01,
                material("surface", 1) + skin("a", floor, 1) + (roofed ? skin("b", roof, 1) : "")
                    + "[[light]]\nposition = [0.0, 1.0, 0.0]\nstrength = [1.0, 1.0, 1.0]\n" + lamp),
            1, 256));
    };
    const std::string point = "kind = \"point\"\n", down = "direction = [0.0, -1.0, 0.0]\n",
                      spot = "kind = \"spot\"\nangle_degrees = 60.0\n" + down,
                      patch = "kind = \"patch\"\n" + down;
    for (const std::string& lamp : {point, spot, patch})
        EXPECT_NEAR(shown(lamp + "radius = 0.1\n", "0.2", false) / shown(lamp, "0.2", false), 1,
                    lamp == point ? 0.002 : 0.02);
    // Below the edge half of the lamp is seen; 0.05 besides, half of that half's reach, the disc's
    // part beyond t = 0.5.
    for (const std::string& lamp : {point, spot, patch}) {
        EXPECT_NEAR(shown(lamp + "radius = 0.1\n", "0.0", true), 0.5, 0.01);
        EXPECT_NEAR(shown(lamp + "radius = 0.1\n", "0.05", true),
                    0.5 + (0.5 * std::sqrt(0.75) + std::asin(0.5)) / kPi, 0.015);
    }
}

TEST(TruthPaths, BlackSendsNothingAndTheBytesDoNotDependOnThreads)
{
    const std::string lights =
        std::string(kWhiteDome) + directional("[0.3, -1.0, 0.2]", "disc_degrees = 5.0");
    const std::string eye = "[0.0, 3.0, 1.0]", target = "[0.0, 0.1, 0.0]";
    const ExactScene black =
        sceneOf(eye, target, 0.8, material("fibre", 1) + field(kHairs, 300, 0) + lights);
    EXPECT_EQ(meanOfCovered(pictureOf(black, 64, 4)), 0);
    const ExactScene grey =
        sceneOf(eye, target, 0.8, material("fibre", 1) + field(kHairs, 300, 0.7) + lights);
    Image one;
    {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
        one = pictureOf(grey, 16, 4);
    }
    EXPECT_EQ(one.pixels, pictureOf(grey, 16, 4).pixels);
    EXPECT_NE(one.pixels, pictureOf(grey, 16, 4, 2).pixels);
    const EmbreeScene embree(grey);
    ExactParams params;
    params.paths = {2, false};
    EXPECT_NE(messageOf([&] { exactPicture(grey, embree, params); }).find("at least 1 bounce"),
              std::string::npos);
}

} // namespace
} // namespace volcomp
