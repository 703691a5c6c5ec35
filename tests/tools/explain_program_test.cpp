// SPDX-License-Identifier: Apache-2.0
// volcomp-render --explain as a process: the table on its output, no picture needed, and errors.
#include <cstdlib>
#include <filesystem>
#include <sstream>

#include <gtest/gtest.h>
#include <openvdb/openvdb.h>
#include <sys/wait.h>

#include "volcomp/view/image.h"
#include "volcomp/volume/vdb_io.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/volumes.h"

using namespace volcomp;

namespace {

constexpr const char* kScene = R"(
[camera]
eye = [0, 0, 5]
target = [0, 0, 0]

[[light]]
name = "sun"
direction = [-1, -2, -1]

[render]
width = 16
height = 12
samples = 4
background = [0.5, 0.25, 1]
)";

struct Outcome {
    int status;
    std::string output, errors;
};

class ExplainProgram : public testing::Test {
protected:
    void SetUp() override
    {
        openvdb::initialize();
        m_folder.write("scene.toml", kScene);
        Volume volume = emptyVolume(0.125);
        volume.parts[0].density->fill(openvdb::CoordBBox({-4, -4, -4}, {3, 3, 3}), 2, true);
        writeVolume(m_folder / "volume.vdb", volume);
    }
    Outcome run(const std::string& arguments) const
    {
        const std::string command = "cd '" + m_folder.path().string()
            + "' && '" VOLCOMP_BIN "/volcomp-render' scene.toml " + arguments
            + " >output.txt 2>errors.txt";
        const int status = std::system(command.c_str());
        return {WIFEXITED(status) ? WEXITSTATUS(status) : 128, m_folder.read("output.txt"),
                m_folder.read("errors.txt")};
    }

    TemporaryFolder m_folder;
};

/// The first three numbers in parentheses of the line that begins with `start`.
Vec3d coloursOf(const std::string& table, const std::string& start)
{
    Vec3d colour(-1.0);
    const std::size_t line = table.find("\n" + start), open = table.find('(', line);
    if (line == std::string::npos || open == std::string::npos) return colour;
    std::istringstream numbers(table.substr(open + 1, 100));
    numbers >> colour[0] >> colour[1] >> colour[2];
    return colour;
}

} // namespace

TEST_F(ExplainProgram, PrintsThePixelOfTheRender)
{
    const Outcome explained = run("--volume volume.vdb --explain 8,5");
    ASSERT_EQ(explained.status, 0) << explained.errors;
    EXPECT_EQ(explained.output.find("pixel 8,5: ray from (0 0 5)"), 0u) << explained.output;
    const Outcome rendered = run("-o picture.exr --samples 1");
    ASSERT_EQ(rendered.status, 0) << rendered.errors;
    EXPECT_EQ(rendered.output, "");
    const Image image = readImage(m_folder / "picture.exr");
    const Vec3d sum = coloursOf(explained.output, "  pixel "),
                terms = coloursOf(explained.output, "  sun ")
        + coloursOf(explained.output, "  ambient ") + coloursOf(explained.output, "  background ");
    for (int c = 0; c < 3; ++c) {
        EXPECT_GT(sum[c], 0);
        EXPECT_NEAR(sum[c], image.pixel(8, 5)[c], 1e-5);
        EXPECT_NEAR(sum[c], terms[c], 3e-6); // of numbers with six digits
    }
    const Outcome both = run("-o both.exr --explain 8,5"); // the volume beside the picture
    EXPECT_EQ(both.status, 0) << both.errors;
    EXPECT_EQ(both.output, explained.output);
    EXPECT_TRUE(std::filesystem::exists(m_folder / "both.exr"));
}

TEST_F(ExplainProgram, WhatIsNoPixelIsAnError)
{
    for (const char* pixel : {"16,5", "8,-1"}) {
        const Outcome outcome = run(std::string("--volume volume.vdb --explain=") + pixel);
        EXPECT_EQ(outcome.status, 1) << pixel;
        EXPECT_NE(outcome.errors.find("--explain: expected a pixel of the picture, X from 0 to 15 "
                                      "and Y from 0 to 11, found "),
                  std::string::npos)
            << outcome.errors;
        EXPECT_EQ(outcome.output, "");
    }
    for (const char* pixel : {"8,", "8,5,3", "99999999999,5"}) {
        const Outcome outcome = run(std::string("--volume volume.vdb --explain=") + pixel);
        EXPECT_EQ(outcome.status, 1) << pixel;
        EXPECT_NE(outcome.errors.find("--explain: expected a pixel X,Y as two whole numbers"),
                  std::string::npos)
            << outcome.errors;
    }
    EXPECT_NE(run("--volume volume.vdb --crop 2,2,4,4 --explain 6,2")
                  .errors.find("X from 2 to 5 and Y from 2 to 5, found 6,2"),
              std::string::npos);
}

TEST_F(ExplainProgram, NeedsAVolumeAndARenderNeedsAPicture)
{
    const Outcome no_volume = run("--explain 8,5");
    EXPECT_EQ(no_volume.status, 1);
    EXPECT_NE(no_volume.errors.find("--explain: expected --volume FILE.vdb"), std::string::npos)
        << no_volume.errors;
    const Outcome nothing = run("--volume volume.vdb");
    EXPECT_EQ(nothing.status, 2);
    EXPECT_NE(nothing.errors.find("--output is required"), std::string::npos) << nothing.errors;
}
