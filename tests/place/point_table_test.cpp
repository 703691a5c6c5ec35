// SPDX-License-Identifier: Apache-2.0
// Places from files: what lists of our own say comes back, and damaged files are refused.
#include "volcomp/place/point_table.h"

#include <gtest/gtest.h>

#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"
#include "volcomp/place/placed_scene.h"
#include "volcomp/place/placements_io.h"

namespace volcomp {
namespace {

SurfaceSpec ground()
{
    SurfaceSpec s;
    s.name = "ground";
    s.terrain.width = s.terrain.depth = 2;
    return s;
}

Layer layerOf(const std::string& box)
{
    Layer l;
    l.name = "layer of " + box;
    l.box = box;
    l.surface = "ground";
    return l;
}

PlacedScene placed(const std::vector<Layer>& layers)
{
    return place({ground()}, layers, {{"oak", 3}, {"big_fern", 2}});
}

class PointTableTest : public testing::Test {
protected:
    TemporaryFolder m_folder;
};

TEST_F(PointTableTest, WhatComposeWritesComesBack)
{
    std::vector<Layer> layers{layerOf("oak"), layerOf("big_fern")};
    for (Layer& l : layers) {
        l.density = 20;
        l.scale = {0.5, 2};
        l.tilt = {0, 0.6};
        MapFactor noise;
        noise.noise = 0.3;
        l.colour = {noise};
    }
    const PlacedScene before = placed(layers);
    for (const char* name : {"list.json", "list.ply"}) {
        const bool json = std::string(name) == "list.json";
        writePlacements(m_folder / name, before);
        std::vector<Layer> again{layerOf("oak"), layerOf("big_fern")};
        for (Layer& l : again) l.points = m_folder / name;
        const PlacedScene after = placed(again);
        ASSERT_EQ(after.boxes.size(), before.boxes.size());
        for (std::size_t i = 0; i < after.boxes.size(); ++i) {
            const Placement &a = before.boxes.placements[i], &b = after.boxes.placements[i];
            EXPECT_EQ(a.box, b.box);
            EXPECT_EQ(a.scale, b.scale);
            EXPECT_NEAR((a.position - b.position).length(), 0, json ? 1e-5 : 0);
            EXPECT_NEAR((a.y_axis - b.y_axis).length(), 0, 1e-5);
            if (json) { // the other has no rotation
                EXPECT_NEAR((a.x_axis - b.x_axis).length(), 0, 1e-5);
            }
            EXPECT_NEAR((a.tint - b.tint).length(), 0, json ? 1e-5 : 0.01);
        }
    }
}

TEST_F(PointTableTest, CsvHasWhateverItsFirstLineNames)
{
    Layer l = layerOf("oak");
    l.points =
        m_folder.write("list.csv",
                       "# places\n x, y,z,scale,variant, qx,qy,qz,qw,red,green,blue,what\n"
                       "1,2,3,0.5,2,0,0,0.70710678118654752,0.70710678118654752,1,0.5,0.25,9\n"
                       "-1,0,0.25,2,3,0,0,0,2,1,1,1,9\n");
    l.scale = {3, 3};
    const auto p = placed({l}).boxes.placements;
    ASSERT_EQ(p.size(), 2u);
    EXPECT_EQ(p[0].position, Vec3d(1, 2, 3));
    EXPECT_EQ(p[0].scale, 1.5f);
    EXPECT_EQ(p[0].box, 1);
    EXPECT_EQ(p[1].box, 2);
    EXPECT_EQ(p[0].tint, Vec3f(1, 0.5f, 0.25f));
    // A quarter turn about Z: X becomes Y, and Y becomes -X.
    EXPECT_NEAR((p[0].x_axis - Vec3f(0, 1, 0)).length(), 0, 1e-6);
    EXPECT_NEAR((p[0].y_axis - Vec3f(-1, 0, 0)).length(), 0, 1e-6);
    EXPECT_NEAR((p[1].x_axis - Vec3f(1, 0, 0)).length(), 0, 1e-6);
}

TEST_F(PointTableTest, WithoutRotationTheLayersKeysCount)
{
    Layer l = layerOf("oak");
    l.points = m_folder.write("list.csv", "x,y,z,nx,ny,nz\n0,5,0,0,0,2\n0.5,0,0,0,1,0\n");
    l.offset = 0.25;
    l.turn = {0, 0};
    const auto p = placed({l}).boxes.placements;
    ASSERT_EQ(p.size(), 2u);
    EXPECT_EQ(p[0].y_axis, Vec3f(0, 0, 1));
    EXPECT_EQ(p[0].position, Vec3d(0, 5, 0.25));
    l.height = {-1, 1, 0}; // masks count
    EXPECT_EQ(placed({l}).boxes.size(), 1u);
}

TEST_F(PointTableTest, AsciiAndBigEndianPly)
{
    const std::string head = "element vertex 1\nproperty float x\nproperty float y\nproperty float "
                             "z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
                             "end_header\n";
    const auto ascii = readPlaces(
        m_folder.write("a.ply", "ply\nformat ascii 1.0\n" + head + "1 2 -0.5 255 0 51\n"));
    ASSERT_EQ(ascii.size(), 1u);
    EXPECT_EQ(ascii[0].position, Vec3d(1, 2, -0.5));
    EXPECT_EQ(ascii[0].tint, Vec3f(1, 0, 0.2f));
    const std::string numbers("\x3f\x80\0\0\x40\0\0\0\xbf\0\0\0\xff\0\x33", 15);
    const auto big =
        readPlaces(m_folder.write("b.ply", "ply\nformat binary_big_endian 1.0\n" + head + numbers));
    ASSERT_EQ(big.size(), 1u);
    EXPECT_EQ(big[0].position, ascii[0].position);
    EXPECT_EQ(big[0].tint, ascii[0].tint);
}

TEST_F(PointTableTest, DamagedFilesAreRefusedAndNamed)
{
    const std::string ply =
        "ply\nformat binary_little_endian 1.0\nelement vertex 9\nproperty float "
        "x\nproperty float y\nproperty float z\nend_header\n";
    const std::vector<std::pair<std::string, std::string>> files = {
        {"a.csv", ""},
        {"b.csv", "1,2,3\n"},
        {"c.csv", "x,y,z\n1,2\n"},
        {"d.csv", "x,y,z\n1,2,three\n"},
        {"e.csv", "x,y,z\n1,2,nan\n"},
        {"f.csv", "x,y,z,scale\n1,2,3,0\n"},
        {"g.csv", "x,y,z,variant\n1,2,3,1.5\n"},
        {"h.csv", "x,y,z,nx,ny,nz\n1,2,3,0,0,0\n"},
        {"i.csv", "x,y,z,qx,qy,qz,qw\n1,2,3,0,0,0,0\n"},
        {"a.json", "{"},
        {"b.json", "{}"},
        {"c.json", "[{}]"},
        {"d.json", "[{\"position\": [1, 2]}]"},
        {"e.json", "[{\"position\": [1, 2, \"3\"]}]"},
        {"a.ply", ply + "123"},
        {"b.ply", "ply\nelement vertex 1\n"},
        {"c.ply", "ply\nformat ascii 1.0\nelement face 1\nend_header\n"},
        {"d.ply",
         "ply\nformat ascii 1.0\nelement vertex 99999999999\nproperty float x\nend_header\n"},
        {"e.ply",
         "ply\nformat ascii 1.0\nelement vertex 1\nproperty list uchar int x\nend_header\n"},
        {"a.txt", "x,y,z\n"},
    };
    for (const auto& [name, content] : files) {
        const std::filesystem::path file = m_folder.write(name, content);
        const std::string message = messageOf([&, &file = file] { readPlaces(file); });
        EXPECT_NE(message.find(name), message.npos) << name << ": " << message;
    }
    messageOf([&] { readPlaces(m_folder / "none.csv"); });
}

} // namespace
} // namespace volcomp
