// SPDX-License-Identifier: Apache-2.0
// volcomp-chart run as a process.
#include <cstdlib>
#include <regex>
#include <string>

#include <gtest/gtest.h>

#include "tests/tools/programs.h"

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

} // namespace
} // namespace volcomp
