// SPDX-License-Identifier: Apache-2.0
// volcomp-truth as a process: how often it scatters light.
#include <string>

#include <gtest/gtest.h>

#include "tests/tools/programs.h"

namespace volcomp {
namespace {

TEST_F(Programs, TruthScattersLightAsOftenAsTheSceneOrTheOptionSays)
{
    const auto bounces = [&](const std::string& options) {
        const Outcome traced =
            run("truth", "scene.toml -o exact.exr --samples 2 --stats truth.json " + options);
        EXPECT_EQ(traced.status, 0) << traced.output;
        return readJson("truth.json")["bounces"].get<int>();
    };
    EXPECT_EQ(bounces(""), 1); // "single"
    EXPECT_EQ(bounces("--bounces 3"), 3);
    const Outcome refused =
        run("truth", "scene.toml -o exact.exr --samples 2 --bounces 3 --no-shadows");
    EXPECT_EQ(refused.status, 1);
    EXPECT_NE(refused.output.find("--bounces: expected 1 beside --no-shadows"), std::string::npos)
        << refused.output;
    EXPECT_NE(refused.output.find("found 3"), std::string::npos) << refused.output;
    EXPECT_EQ(bounces("--scattering multiple"), 64);
    write("scene.toml", read("scene.toml") + "scattering = \"multiple\"\n");
    EXPECT_EQ(bounces("--scattering single"), 1);
    EXPECT_EQ(bounces(""), 64);
    EXPECT_EQ(bounces("--no-shadows"), 1);
}

} // namespace
} // namespace volcomp
