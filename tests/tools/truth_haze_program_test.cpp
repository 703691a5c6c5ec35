// SPDX-License-Identifier: Apache-2.0
// Haze by the whole chain: volcomp-render's picture of a scene against volcomp-truth's.
#include <string>

#include <gtest/gtest.h>

#include "tests/tools/programs.h"

namespace volcomp {
namespace {

/// Between the eye and the square it lets 0.58 to 0.68 of the light through.
constexpr const char* kHaze = "\n[haze]\ncolour = [0.5, 0.6, 0.8]\ndensity = 0.5\nheight = 0.6\n";

class TruthHaze : public Programs {
protected:
    /// Writes scene.toml with fine fur on a skin that is a mesh, composes and renders it.
    void make(const std::string& density, const std::string& haze)
    {
        writeSceneWith({{"skin_as", ""},
                        {"density", "density = " + density},
                        {"voxel = 0.01", "voxel = 0.004"},
                        {"voxel = 0.02", "voxel = 0.006"}});
        write("scene.toml", read("scene.toml") + haze);
        bakeAndCompose();
        const Outcome rendered = render("-o a.exr --samples 16");
        ASSERT_EQ(rendered.status, 0) << rendered.output;
    }
    /// How far a.exr is from the exact picture of scene.toml, which `options` take or trace.
    nlohmann::json errorTo(const std::string& options)
    {
        const Outcome compared =
            run("truth", "scene.toml --compare a.exr --stats stats.json " + options);
        EXPECT_EQ(compared.status, 0) << compared.output;
        return readJson("stats.json")["error"];
    }
};

TEST_F(TruthHaze, ASkinInItIsAsPathsShowIt)
{
    make("0", kHaze);
    const nlohmann::json error = errorTo("--samples 64");
    EXPECT_NEAR(double(error["bias"]), 0, 5e-4);
    EXPECT_LT(double(error["rmse"]), 4e-3); // at the square's edges, where pixels are sampled
    EXPECT_LT(double(error["block_rmse"]), 1e-3);
    EXPECT_NEAR(double(error["alpha_bias"]), 0, 1e-6); // haze has no end
}

// In clear air fur differs from its strands by 0.157 of a mean of 0.108, in blocks by 0.058. Haze
// lets 0.63 of that through, and its own light makes the mean 0.569: 0.019 and 0.007 are left.
TEST_F(TruthHaze, FurInItIsAsPathsShowIt)
{
    make("60", kHaze);
    const nlohmann::json error = errorTo("--samples 64 -o exact.exr");
    EXPECT_NEAR(double(error["bias"]), 0, 2e-3);
    EXPECT_LT(double(error["rmse"]), 0.025);
    EXPECT_LT(double(error["block_rmse"]), 0.009);
    EXPECT_NEAR(double(error["alpha_bias"]), 0, 1e-6);
    // Without haze the picture is another one.
    make("60", "");
    EXPECT_GT(double(errorTo("--known exact.exr")["block_rmse"]), 0.5);
}

} // namespace
} // namespace volcomp
