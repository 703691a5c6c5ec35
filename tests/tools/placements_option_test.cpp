// SPDX-License-Identifier: Apache-2.0
// volcomp-compose --placements, read back and compared with what the library places.
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "volcomp/scene/place_scene.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;

constexpr const char* kScene = R"(
[material.fur]
kind = "fibre"

[box.tuft]
material = "fur"
variants = 2
voxel = 0.02
level = [{length = 0.2, radius = 0.01}]

[surface.ground]
ground = [1, 1]

[[layer]]
name = "first"
box = "tuft"
density = 150
size = [0.5, 1.5]
tilt_degrees = [0, 30]
colour = [{noise = 0.2}]

[[layer]]
name = "second"
box = "tuft"
density = 50
)";

class PlacementsOption : public testing::Test {
protected:
    void SetUp() override
    {
        m_dir = fs::path(testing::TempDir())
            / (std::string("placements_option_")
               + testing::UnitTest::GetInstance()->current_test_info()->name());
        fs::remove_all(m_dir);
        fs::create_directories(m_dir);
        std::ofstream(m_dir / "scene.toml") << kScene;
        run("volcomp-bake scene.toml -o boxes");
    }
    void TearDown() override { fs::remove_all(m_dir); }

    void run(const std::string& command)
    {
        const std::string line =
            "cd '" + m_dir.string() + "' && " + VOLCOMP_BIN + "/" + command + " --quiet";
        ASSERT_EQ(std::system(line.c_str()), 0) << line;
    }
    std::string written(const std::string& file)
    {
        run("volcomp-compose scene.toml --boxes boxes --placements " + file);
        std::ifstream stream(m_dir / file, std::ios::binary);
        return {std::istreambuf_iterator<char>(stream), {}};
    }
    PlacedScene placed() const
    {
        PlaceOptions options;
        options.keep_uvs = true;
        return place(readScene(m_dir / "scene.toml"), options);
    }

    fs::path m_dir;
};

TEST_F(PlacementsOption, writesJson)
{
    const auto json = nlohmann::json::parse(written("p.json"));
    const PlacedScene scene = placed();
    const std::vector<std::string> boxes = boxNames(scene.kinds);
    ASSERT_EQ(json.size(), 200u);
    for (std::size_t i = 0; i < 200; ++i) {
        const Placement& p = scene.boxes.placements[i];
        EXPECT_EQ(json[i]["box"], boxes[p.box]);
        EXPECT_EQ(json[i]["layer"], i < 150 ? "first" : "second");
        EXPECT_EQ(json[i]["scale"].get<float>(), p.scale);
        for (int c = 0; c < 3; ++c) { // every number is read back as it was
            EXPECT_EQ(json[i]["position"][c].get<double>(), p.position[c]);
            EXPECT_EQ(json[i]["x_axis"][c].get<float>(), p.x_axis[c]);
            EXPECT_EQ(json[i]["y_axis"][c].get<float>(), p.y_axis[c]);
            EXPECT_EQ(json[i]["z_axis"][c].get<float>(), p.z_axis[c]);
            EXPECT_EQ(json[i]["tint"][c].get<float>(), p.tint[c]);
        }
        for (int c = 0; c < 2; ++c) EXPECT_EQ(json[i]["uv"][c].get<float>(), scene.boxes.uvs[i][c]);
    }
}

TEST_F(PlacementsOption, writesPly)
{
    const std::string bytes = written("p.ply"), end = "end_header\n";
    const PlacedScene scene = placed();
    EXPECT_NE(bytes.find("comment box 1 tuft_2\n"), std::string::npos);
    EXPECT_NE(bytes.find("comment layer 1 second\n"), std::string::npos);
    EXPECT_NE(bytes.find("element vertex 200\n"), std::string::npos);
    const std::size_t header = bytes.find(end) + end.size();
    constexpr std::size_t kRecord = 3 * 8 + 3 * 4 + 3 + 4 + 4 + 4;
    ASSERT_EQ(bytes.size(), header + 200 * kRecord);
    for (std::size_t i = 0; i < 200; ++i) {
        const char* at = bytes.data() + header + i * kRecord;
        const auto next = [&](auto value) {
            std::memcpy(&value, at, sizeof value);
            at += sizeof value;
            return value;
        };
        const Placement& p = scene.boxes.placements[i];
        for (int c = 0; c < 3; ++c) EXPECT_EQ(next(0.0), p.position[c]);
        for (int c = 0; c < 3; ++c) EXPECT_EQ(next(0.0f), p.y_axis[c]);
        for (int c = 0; c < 3; ++c)
            EXPECT_NEAR(next(std::uint8_t()) / 255.0, p.tint[c], 0.5 / 255 + 1e-6);
        EXPECT_EQ(next(0.0f), p.scale);
        EXPECT_EQ(next(std::int32_t()), p.box);
        EXPECT_EQ(next(std::int32_t()), p.layer);
    }
}

} // namespace
} // namespace volcomp
