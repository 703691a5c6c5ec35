// SPDX-License-Identifier: Apache-2.0
#include "volcomp/place/placements_io.h"

#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/temporary_folder.h"
#include "volcomp/base/error.h"

namespace volcomp {
namespace {

TEST(PlacementsIo, jsonAndPlyHoldWhatIsPlaced)
{
    PlacedScene scene;
    scene.kinds = {{"a \"b\"", 1}};
    scene.layers.resize(2);
    scene.layers[0].layer.name = "x";
    scene.layers[1].layer.name = "y";
    scene.boxes.placements.resize(3);
    std::vector<Placement>& p = scene.boxes.placements;
    p[1].position = Vec3d(1.5, -2, 1e6);
    p[1].scale = 0.5f;
    p[1].x_axis = Vec3f(0, 0, -1);
    p[1].z_axis = Vec3f(1, 0, 0);
    scene.boxes.uvs = {{0, 0}, {0.25, 0.75}, {0, 0}};
    p[1].tint = Vec3f(1, 0.5f, 0.2f);
    p[2].layer = 1;
    const std::filesystem::path dir = ::testing::TempDir();
    writePlacements(dir / "volcomp_placements_io_test.json", scene);
    std::ifstream stream(dir / "volcomp_placements_io_test.json");
    const auto json = nlohmann::json::parse(stream);
    ASSERT_EQ(json.size(), 3u);
    EXPECT_EQ(json[1]["position"][2], 1e6);
    EXPECT_EQ(json[1]["scale"], 0.5);
    EXPECT_EQ(json[1]["x_axis"], (std::vector<double>{0, 0, -1}));
    EXPECT_EQ(json[1]["y_axis"], (std::vector<double>{0, 1, 0}));
    EXPECT_EQ(json[1]["z_axis"], (std::vector<double>{1, 0, 0}));
    EXPECT_EQ(json[1]["uv"], (std::vector<double>{0.25, 0.75}));
    EXPECT_EQ(json[0]["box"], "a \"b\"_1");
    EXPECT_EQ(json[2]["layer"], "y");
    writePlacements(dir / "volcomp_placements_io_test.ply", scene);
    EXPECT_THROW(writePlacements(dir / "volcomp_placements_io_test.txt", scene), Error);
    std::ifstream ply(dir / "volcomp_placements_io_test.ply", std::ios::binary);
    std::string bytes((std::istreambuf_iterator<char>(ply)), {});
    const char* record = bytes.data() + bytes.find("end_header\n")
        + 11; // packed: position, normal, colour, scale, box, layer
    ASSERT_EQ(bytes.data() + bytes.size() - record, 3 * 51);
    const auto read = [&](int placement, int offset, auto value) {
        std::memcpy(&value, record + 51 * placement + offset, sizeof value);
        return value;
    };
    EXPECT_EQ(read(1, 0, 0.0), 1.5);
    EXPECT_EQ(read(1, 16, 0.0), 1e6);
    EXPECT_EQ(Vec3f(read(1, 24, 0.0f), read(1, 28, 0.0f), read(1, 32, 0.0f)), Vec3f(0, 1, 0));
    for (int c = 0; c < 3; ++c)
        EXPECT_EQ(int(read(1, 36 + c, std::uint8_t())), c == 0 ? 255 : c == 1 ? 128 : 51);
    EXPECT_EQ(read(1, 39, 0.0f), 0.5f);
    EXPECT_EQ(read(2, 43, 0), 0);
    EXPECT_EQ(read(2, 47, 0), 1);
}

TEST(PlacementsIo, namesCannotBreakTheFile)
{
    const TemporaryFolder folder;
    PlacedScene scene;
    scene.kinds = {{"a\nelement vertex 9", 1}};
    scene.layers.resize(1);
    scene.layers[0].layer.name = "x\r\nend_header\n\xff";
    scene.boxes.placements.resize(1);
    writePlacements(folder / "a.PLY", scene);
    writePlacements(folder / "a.Json", scene);
    std::istringstream stream(folder.read("a.PLY"));
    std::size_t header = 0;
    for (std::string line; std::getline(stream, line) && line != "end_header";) {
        header += line.size() + 1;
        EXPECT_TRUE(line == "ply" || line.rfind("format ", 0) == 0 || line.rfind("comment ", 0) == 0
                    || line == "element vertex 1" || line.rfind("property ", 0) == 0)
            << line;
    }
    EXPECT_EQ(folder.read("a.PLY").size(), header + std::string("end_header\n").size() + 51);
    EXPECT_NE(folder.read("a.PLY").find("comment box 0 a\\x0Aelement vertex 9_1\n"),
              std::string::npos);
    const auto json = nlohmann::json::parse(folder.read("a.Json"));
    EXPECT_EQ(json[0]["box"], "a\nelement vertex 9_1");
}

} // namespace
} // namespace volcomp
