// SPDX-License-Identifier: Apache-2.0
// volcomp-chart run as a process.
#include <cstdlib>
#include <regex>
#include <string>

#include <gtest/gtest.h>

#include "tests/tools/programs.h"
#include "volcomp/view/image.h"

namespace volcomp {
namespace {

// The whole matrix on a small picture; the second run measures nothing again and draws the same.
TEST_F(Programs, TheChartIsMeasuredOnceAndDrawn)
{
    if (std::system("command -v gnuplot >/dev/null") != 0)
        GTEST_SKIP() << "gnuplot is not installed";
    // What the scene names is told from texts that only look like names, however long they are.
    write("scene.toml", kScene + ("# \"" + std::string(50000, 'x')) + "\"\n");
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
    EXPECT_LT(std::stod(found[2]), 3e-4);
    EXPECT_GT(std::stod(found[1]), 1e-3);

    const Outcome second = run("chart", command);
    ASSERT_EQ(second.status, 0) << second.output;
    EXPECT_EQ(read("chart/results.csv"), csv);
    EXPECT_EQ(readJson("chart.json")["stages"].size(), 1u) << second.output; // drawing
}

// Each point of other light is compared with a reference in this light.
TEST_F(Programs, TheChartMeasuresOtherLightAgainstItself)
{
    if (std::system("command -v gnuplot >/dev/null") != 0)
        GTEST_SKIP() << "gnuplot is not installed";
    const Outcome outcome =
        run("chart", "scene.toml -o chart --width 24 --samples 5 --no-voxels --lights");
    ASSERT_EQ(outcome.status, 0) << outcome.output;
    const std::string csv = read("chart/results.csv"), table = read("chart/table.md");
    const auto errorOf = [&](const std::string& name) {
        std::smatch found;
        const std::size_t at = csv.find("radiance,\"" + name + "\"");
        EXPECT_NE(at, std::string::npos) << name;
        const std::string row = csv.substr(at);
        EXPECT_TRUE(std::regex_search(
            row, found, std::regex("^radiance,\"[^\"]*\",\"[^\"]*\",[0-9.]+,([^,]+),")));
        return std::stod(found[1]);
    };
    // Beside a reference in the scene's light they would be off by 1.9 and 1.2 times as much.
    const double own = errorOf("sweep, 4");
    EXPECT_LT(errorOf("multiple, 4"), 1.2 * own);
    EXPECT_LT(errorOf("dome, 4"), 1.1 * own);
    EXPECT_NE(table.find("| dome, 4 |"), std::string::npos) << table;
    EXPECT_EQ(csv.find("\"single, 4\""), std::string::npos);
}

// gnuplot and OpenImageIO read names in their own ways, and a path may hold anything.
TEST_F(Programs, TheChartIsDrawnInAFolderOfAnyName)
{
    if (std::system("command -v gnuplot >/dev/null") != 0)
        GTEST_SKIP() << "gnuplot is not installed";
    const std::string folder = "a\nb?c*'e\"";
    std::filesystem::create_directories(path(folder + "/chart"));
    for (const char* name : {"scene.toml", "ground.obj", "where.pgm"})
        std::filesystem::copy_file(path(name), path(folder + "/" + name));
    // The shell finds the folder.
    const Outcome outcome =
        run("chart", "a*/scene.toml -o a*/chart --width 16 --samples 5 --no-voxels");
    ASSERT_EQ(outcome.status, 0) << outcome.output;
    EXPECT_EQ(read(folder + "/chart/chart.png").substr(1, 3), "PNG");
    EXPECT_NE(read(folder + "/chart/chart.svg").find("<svg"), std::string::npos);
}

// Every figure is volcomp-truth's own, and a second run measures nothing again.
TEST_F(Programs, TheChartComparesWithTheGeometry)
{
    if (std::system("command -v gnuplot >/dev/null") != 0)
        GTEST_SKIP() << "gnuplot is not installed";
    writeSceneWith("height = 32", "height = 32\nbackground = [0.5, 0.5, 0.5]"); // which alpha ends
    const std::string command =
        "--truth -o chart --width 24 --voxels 2 scene.toml --stats stats.json --truth-samples ";
    const Outcome first = run("chart", command + "64");
    ASSERT_EQ(first.status, 0) << first.output;
    EXPECT_EQ(read("chart/truth.png").substr(1, 3), "PNG");
    EXPECT_NE(read("chart/truth.svg").find("<svg"), std::string::npos);
    const nlohmann::json found = readJson("chart/truth.json");
    EXPECT_EQ(found["width"], 24);
    EXPECT_EQ(found["height"], 16);
    ASSERT_EQ(found["results"].size(), 4u + 3); // curves, voxels
    const std::string table = read("chart/truth.md");
    const std::string exact = "chart/" + std::string(found["exact"]["picture"]);
    for (const nlohmann::json& r : found["results"]) {
        EXPECT_NE(table.find("| " + std::string(r["name"]) + " |"), std::string::npos) << r;
        double sum = 0;
        for (const char* part : {"bake", "build", "load", "picture"})
            sum += double(r["cost"][part]["cpu_seconds"]);
        EXPECT_NEAR(sum, r["cost"]["sum"]["cpu_seconds"], 1e-9) << r;
        EXPECT_GT(sum, 0) << r;
        const Image image = readImage(path("chart") / std::string(r["picture"]));
        for (int c = 0; c < 4; ++c) EXPECT_EQ(image.pixel(0, 0)[c], 0) << r; // beside the square
        if (r["samples"] != 4) continue;
        const Outcome compared = run("truth",
                                     "scene.toml --known " + exact + " --compare chart/"
                                         + std::string(r["picture"]) + " --stats compared.json");
        ASSERT_EQ(compared.status, 0) << compared.output;
        EXPECT_EQ(readJson("compared.json")["error"], r["error"]) << r;
    }
    // One curve's own noise is many times the rest, and falls with the samples.
    EXPECT_GT(double(found["results"][0]["error"]["rmse"]),
              3 * double(found["results"][3]["error"]["rmse"]));
    EXPECT_LT(double(found["results"][3]["error"]["rmse"]), 0.2);

    const Outcome second = run("chart", command + "64");
    ASSERT_EQ(second.status, 0) << second.output;
    EXPECT_EQ(readJson("chart/truth.json"), found);
    EXPECT_EQ(readJson("stats.json")["stages"].size(), 1u) << second.output; // drawing
    // Another exact picture is traced, and nothing else.
    const Outcome third = run("chart", command + "16");
    ASSERT_EQ(third.status, 0) << third.output;
    EXPECT_EQ(readJson("stats.json")["stages"].size(), 2u) << third.output;
    EXPECT_EQ(readJson("chart/truth.json")["results"][5]["cost"], found["results"][5]["cost"]);
}

// Other light has exact pictures, curves and charts of its own.
TEST_F(Programs, TheChartComparesOtherLightWithTheGeometryInThisLight)
{
    if (std::system("command -v gnuplot >/dev/null") != 0)
        GTEST_SKIP() << "gnuplot is not installed";
    const Outcome first = run("chart",
                              "scene.toml --truth -o chart --width 24 --voxels 2 --truth-samples "
                              "16 --lights");
    ASSERT_EQ(first.status, 0) << first.output;
    const nlohmann::json found = readJson("chart/truth.json");
    ASSERT_EQ(found["other_lights"].size(), 2u);
    const std::string own = found["exact"]["picture"];
    for (const auto& [light, option] :
         {std::pair{"multiple", "--scattering multiple"}, {"dome", "--dome 0.5"}}) {
        const nlohmann::json& there = found["other_lights"][light];
        ASSERT_EQ(there["results"].size(), 4u + 3) << light;
        EXPECT_EQ(read(std::string("chart/truth_") + light + ".png").substr(1, 3), "PNG");
        const std::string exact = there["exact"]["picture"];
        EXPECT_NE(exact, own);
        // The reference is what volcomp-truth makes of this light, the picture what
        // volcomp-render makes.
        const nlohmann::json& row = there["results"][5];
        ASSERT_EQ(row["samples"], 4);
        const auto errorTo = [&](const std::string& known) {
            const Outcome compared =
                run("truth",
                    "scene.toml --known chart/" + known + " --compare chart/"
                        + std::string(row["picture"]) + " --stats compared.json");
            EXPECT_EQ(compared.status, 0) << compared.output;
            return readJson("compared.json")["error"];
        };
        EXPECT_EQ(errorTo(exact), row["error"]) << light;
        const Outcome traced = run("truth",
                                   "scene.toml --size 24x16 --no-background --samples 16 --seed 1 "
                                   "-o again.exr "
                                       + std::string(option));
        ASSERT_EQ(traced.status, 0) << traced.output;
        EXPECT_EQ(readImage(path("again.exr")).pixels, readImage(path("chart") / exact).pixels)
            << light;
    }
    EXPECT_NE(read("chart/truth.md").find("# scene, dome: "), std::string::npos);
    // The second run only draws.
    const Outcome second = run("chart",
                               "scene.toml --truth -o chart --width 24 --voxels 2 --truth-samples "
                               "16 --lights --stats stats.json");
    ASSERT_EQ(second.status, 0) << second.output;
    EXPECT_EQ(readJson("chart/truth.json"), found);
    EXPECT_EQ(readJson("stats.json")["stages"].size(), 3u) << second.output;
}

TEST_F(Programs, TheChartAgainstTheGeometryRefusesWhatItCannotDo)
{
    if (std::system("command -v gnuplot >/dev/null") != 0)
        GTEST_SKIP() << "gnuplot is not installed";
    EXPECT_EQ(run("chart", "scene.toml --truth -o chart --voxels 1,x").status, 2);
    EXPECT_EQ(run("chart", "scene.toml --truth -o chart --voxels 0").status, 2);
    EXPECT_EQ(run("chart", "scene.toml --truth -o chart --truth-samples 1").status, 2);
    EXPECT_EQ(run("chart", "scene.toml -o chart --truth-samples 64").status, 2);
    EXPECT_EQ(run("chart", "scene.toml --truth -o chart --samples 64").status, 2);
    expectFailure(run("chart", "scene.toml --truth -o chart.png"),
                  {"chart.png: -o: expected the name of a folder", "found that of a picture"},
                  "chart.png");
    expectFailure(run("chart", "scene.toml --truth -o chart --leave-out wall"),
                  {"--leave-out: expected the name of a surface (ground), found 'wall'"},
                  "chart/truth.png");
    writeSceneWith("direction = [-1, -2, -1]", "direction = [-1, -2, -1]\nstrength = [0, 0, 0]");
    expectFailure(
        run("chart", "scene.toml --truth -o chart --width 16 --truth-samples 2"),
        {"scene.toml: expected a camera that sees something lit", "found a black picture"},
        "chart/truth.png");
}

} // namespace
} // namespace volcomp
