// SPDX-License-Identifier: Apache-2.0
// Scattered light, the dome and soft lights of the exact picture against what is known of them.
#include <cmath>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"
#include "tools/truth/exact_picture.h"
#include "volcomp/base/vec.h"

namespace volcomp {
namespace {

/// A rectangle in an OBJ file: a corner and two edges.
void writePlate(const std::filesystem::path& file, const Vec3d& corner, const Vec3d& u,
                const Vec3d& v)
{
    std::ofstream out(file);
    for (const Vec3d& p : {corner, corner + u, corner + u + v, corner + v})
        out << "v " << p[0] << ' ' << p[1] << ' ' << p[2] << '\n';
    out << "f 1 2 3 4\n";
}

/// The plates of a test, each the skin of a surface, and what else stands in the scene file. The
/// camera looks down on the square from (-1, -1) to (1, 1) in x and z.
class Room {
public:
    void addPlate(const std::string& name, const Vec3d& corner, const Vec3d& u, const Vec3d& v)
    {
        writePlate(m_folder.path() / (name + ".obj"), corner, u, v);
        m_text += "[surface." + name + "]\nmesh = \"" + name + ".obj\"\nskin = \"matt\"\n"
            + "skin_colour = [1.0, 0.5, 0.0]\n";
    }
    void add(const std::string& text) { m_text += text + "\n"; }

    Image picture(int samples, int bounces = 0, int width = 16) const
    {
        const auto file = m_folder.path() / "scene.toml";
        std::ofstream(file)
            << "[camera]\nprojection = \"orthographic\"\neye = [0, 10, 0]\ntarget = [0, 0, 0]\n"
               "up = [0, 0, -1]\nwidth = 2\n[render]\nheight = 1\nwidth = "
            << width
            << "\nscattering = \"multiple\"\n[material.matt]\nkind = \"surface\"\nbeta = 0\n"
               "alpha = 0.8\n"
            << m_text;
        const ExactScene scene = makeExactScene(readScene(file));
        const EmbreeScene embree(scene);
        ExactParams params;
        params.samples = samples;
        params.bounces = bounces;
        params.halves = false;
        return exactPicture(scene, embree, params);
    }

private:
    TemporaryFolder m_folder;
    std::string m_text;
};

// A white furnace: whatever stands there, it is as bright as what is all around it.
TEST(LightPath, WhiteThingsInAWhiteRoomCannotBeSeen)
{
    Room room;
    room.addPlate("floor", {-2, 0, -2}, {0, 0, 4}, {4, 0, 0});
    room.add(R"(
[dome]
colour = [1, 1, 1]
[material.white]
kind = "surface"
alpha = 1
beta = 0
[material.leaf]
kind = "surface"
alpha = 0.6
transmission = [0.4, 0.4, 0.4]
beta = 0
[material.hair]
alpha = 1
beta = 0
[box.tuft]
material = "hair"
variants = 1
level = [{ count = 40, spread = 0.1, length = 0.4, radius = 0.004, angle_degrees = [0, 40], colour_root = [1, 1, 1], colour_tip = [1, 1, 1] }]
[box.plant]
material = "leaf"
variants = 1
level = [{ outline = "ellipse", count = 30, spread = 0.2, length = 0.3, width_ratio = 0.4, angle_degrees = [10, 80], colour_root = [1, 1, 1], colour_tip = [1, 1, 1] }]
[surface.ground]
ground = [4, 4]
translate = [0, 0.001, 0]
skin = "white"
skin_colour = [1, 1, 1]
[[layer]]
box = "tuft"
surface = "ground"
density = 40
[[layer]]
box = "plant"
surface = "ground"
density = 10
)");
    const Image image = room.picture(400, 512);
    double sum = 0;
    for (int x = 0; x < image.width; ++x) sum += image.pixel(x, 0)[1];
    EXPECT_NEAR(sum / image.width, 1, 0.003);
}

// The dome over an open floor shows the floor's albedo, over one with a plate close above it
// nothing, in single scattering.
TEST(LightPath, TheDomeIsOccluded)
{
    Room room;
    room.add("[dome]\ncolour = [2, 2, 2]\nvisible = false");
    room.addPlate("floor", {-1, 0, -1}, {0, 0, 2}, {2, 0, 0});
    EXPECT_NEAR(room.picture(16, 1, 1).pixel(0, 0)[0], 1.6, 1e-6);
    room.addPlate("wall", {1, 0, -500}, {0, 1000, 0}, {0, 0, 1000}); // takes half of the sky
    EXPECT_NEAR(room.picture(40000, 1, 1).pixel(0, 0)[0], 0.8, 0.01);
}

// A floor beside a wall that the light meets head on, and that the floor sees at an elevation of up
// to e: the form factor of an endless strip is (1 - cos e) / 2.
TEST(LightPath, AWallLightsTheFloorByItsFormFactor)
{
    Room room;
    room.addPlate("floor", {-1, 0, -1}, {0, 0, 2}, {2, 0, 0});
    room.addPlate("wall", {1, 0, -500}, {0, 2, 0}, {0, 0, 1000});
    room.add("[[light]]\ndirection = [1, 0, 0]\nstrength = [1, 1, 1]");
    const Image once = room.picture(4, 1), twice = room.picture(20000, 2);
    for (int x = 0; x < once.width; ++x) {
        EXPECT_LT(once.pixel(x, 0)[0], 1e-9);
        const double d = 1 - (-1 + 2 * (x + 0.5) / once.width),
                     expected = 0.8 * 0.8 * 0.5 * (1 - d / std::sqrt(d * d + 4));
        EXPECT_NEAR(twice.pixel(x, 0)[0], expected, 0.012 * 0.3 + 0.002) << x;
        EXPECT_NEAR(twice.pixel(x, 0)[1], 0.25 * twice.pixel(x, 0)[0], 1e-6); // colour squared
    }
}

// Under an edge a light with a disc draws a penumbra: the part of the disc that is seen.
TEST(LightPath, ADiscDrawsAPenumbra)
{
    for (const bool parallel : {true, false}) {
        Room room;
        room.addPlate("floor", {-1, 0, -1}, {0, 0, 2}, {2, 0, 0});
        room.addPlate("roof", {-9, 20, -9}, {0, 0, 18}, {9, 0, 0}); // above the camera
        const double reach = parallel ? 20 * std::tan(2 * kDegree) : 20 / 980.0 * 30;
        room.add(parallel ? "[[light]]\ndirection = [0, -1, 0]\ndisc_degrees = 4"
                          : "[[light]]\nkind = \"point\"\nposition = [0, 1000, 0]\nradius = 30\n"
                            "strength = [1e6, 1e6, 1e6]");
        const Image image = room.picture(20000, 1);
        for (int x = 0; x < image.width; ++x) {
            // Seen from x > 0 the edge lies before the disc's middle by x of its radius.
            const double at = -1 + 2 * (x + 0.5) / image.width,
                         s = std::min(1.0, std::max(-1.0, at / reach)),
                         seen = 1 - (std::acos(s) - s * std::sqrt(1 - s * s)) / kPi;
            EXPECT_NEAR(image.pixel(x, 0)[0], 0.8 * seen, 0.012) << parallel << ' ' << x;
        }
    }
}

// Light from behind comes through a plate with transmission.
TEST(LightPath, TransmissionIsSeenFromBehind)
{
    Room room;
    room.add("[material.paper]\nkind = \"surface\"\nbeta = 0\nalpha = 0.5\n"
             "transmission = [0.3, 0.3, 0.3]");
    room.add("[surface.lamp]\nground = [4, 4]\nskin = \"paper\"\nskin_colour = [0.5, 1, 1]");
    room.add("[[light]]\ndirection = [0, 0.5, 0.8660254037844386]\nstrength = [2, 2, 2]");
    const Image image = room.picture(4, 1);
    EXPECT_NEAR(image.pixel(3, 0)[0], 0.3 * 0.5 * 2 * 0.5, 1e-6);
    EXPECT_NEAR(image.pixel(3, 0)[1], 0.3 * 1 * 2 * 0.5, 1e-6);
}

} // namespace
} // namespace volcomp
