// SPDX-License-Identifier: Apache-2.0
// What volcomp-chart --truth says of results that are known.
#include "tools/chart/truth_report.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tools/chart/truth_chart.h"

namespace volcomp {
namespace {

/// Curves with the errors 2 / sqrt(samples), in blocks a quarter of it, and 0.1 s a sample.
std::vector<TruthResult> curves()
{
    std::vector<TruthResult> results;
    for (const int samples : kCurveSamples) {
        TruthResult r;
        r.curves = true;
        r.row.samples = samples;
        r.costs.picture = {0.1 * samples, 0.05 * samples};
        r.error.rmse = 2 / std::sqrt(double(samples));
        r.error.block_rmse = 0.25 * r.error.rmse;
        results.push_back(r);
    }
    return results;
}

/// A volume whose parts take `seconds` in all, a quarter each, with these samples of curves in
/// seconds at equal error in blocks.
TruthResult volume(double factor, int samples, double seconds, double curve_seconds)
{
    TruthResult r;
    r.row = {factor, Filter::box, Shadows::sweep, samples};
    r.voxel = 0.001 * factor;
    for (Cost* part : {&r.costs.bake, &r.costs.build, &r.costs.load, &r.costs.picture})
        *part = {seconds / 4, seconds / 8};
    r.error.rmse = 0.2, r.error.block_rmse = 0.1, r.error.bias = -0.03, r.error.alpha_bias = 0.004;
    r.at_pixels = {EqualError::From::beyond, 2 * curve_seconds, 20 * curve_seconds};
    r.at_blocks = {EqualError::From::between, curve_seconds, 10 * curve_seconds};
    return r;
}

std::vector<TruthResult> withVolumes(std::initializer_list<TruthResult> volumes)
{
    std::vector<TruthResult> results = curves();
    results.insert(results.end(), volumes);
    return results;
}

TEST(TruthRows, OtherMethodsAreAtTheScenesVoxelUnlessAllAreAskedFor)
{
    const std::vector<TruthRow> rows = truthRows({0.5, 1}, false);
    ASSERT_EQ(rows.size(), 3u + 3 + 3 + 3 + 1);
    EXPECT_EQ(rows[2].factor, 0.5);
    EXPECT_EQ(rows[2].samples, 16);
    const TruthRow& dearest = rows.back();
    EXPECT_TRUE(dearest.filter == Filter::trilinear && dearest.shadows == Shadows::exact);
    EXPECT_EQ(dearest.samples, 4);
    EXPECT_EQ(truthRows({0.5, 1}, true).size(), 2u * 4 * 3);
}

TEST(TruthReport, TheTitleSaysWhoIsCheaper)
{
    EXPECT_EQ(truthTitle("fur", withVolumes({volume(1, 4, 2, 10)})),
              "fur: volumes are 5.0 times cheaper than curves at equal error in blocks");
    EXPECT_EQ(truthTitle("oak", withVolumes({volume(1, 4, 30, 2.5)})),
              "oak: curves are 12 times cheaper than volumes at equal error in blocks");
    EXPECT_EQ(truthTitle("fern", withVolumes({volume(1, 4, 2, 2.1)})),
              "fern: volumes cost about as much as curves at equal error in blocks");
    EXPECT_EQ(truthTitle("none", curves()), "none: pictures of volumes and of curves");
}

TEST(TruthReport, ItIsAboutTheBestOfTheScenesVoxels)
{
    const auto results = withVolumes(
        {volume(0.5, 4, 1, 10), volume(1, 1, 4, 6), volume(1, 4, 2, 6), volume(2, 4, 1, 10)});
    ASSERT_NE(referenceOf(results), nullptr);
    EXPECT_EQ(nameOf(*referenceOf(results)), "voxels x1, box, sweep, 4 samples");
    EXPECT_EQ(referenceOf(curves()), nullptr);
}

TEST(TruthReport, TableSentencesAndJsonHoldTheFigures)
{
    const auto results = withVolumes({volume(1, 4, 2, 10)});
    const std::string table = truthTable(results);
    EXPECT_NE(
        table.find("| voxels x1, box, sweep, 4 samples | 0.2000 | 0.1000 | -3.0 % | +0.0040 | "
                   "0.50 | 0.50 | 0.50 | 0.50 | 2.00 | 0.1 * | 0.2 |"),
        std::string::npos)
        << table;
    EXPECT_NE(table.find("| curves, 1 sample | 2.0000 | 0.5000 |"), std::string::npos) << table;
    const std::string sentences = truthSentences(results);
    EXPECT_NE(sentences.find("At equal error in blocks (10 %), voxels x1, box, sweep, 4 samples "
                             "takes 0.2 times the time of curves: 2.00 against 10.00 CPU seconds "
                             "(interpolated: 100 samples)."),
              std::string::npos)
        << sentences;
    EXPECT_NE(sentences.find("extrapolated: 200 samples"), std::string::npos) << sentences;
    std::vector<TruthOfLight> lights(2);
    lights[0].exact = "chart/cache/exact.exr";
    lights[0].results = results;
    lights[1].light.name = "dome";
    lights[1].exact = "chart/cache/dome.exr";
    lights[1].results = curves();
    const auto json = truthJson(lights, {}, "chart");
    EXPECT_EQ(json["exact"]["picture"], "cache/exact.exr");
    EXPECT_EQ(json["results"][4]["equal_blocks"]["times_of_curves"], 0.2);
    EXPECT_EQ(json["results"][4]["cost"]["sum"]["cpu_seconds"], 2.0);
    EXPECT_EQ(json["results"][4]["cost"]["sum"]["wall_seconds"], 1.0);
    EXPECT_EQ(json["results"][3]["kind"], "curves");
    EXPECT_EQ(json["other_lights"]["dome"]["exact"]["picture"], "cache/dome.exr");
    EXPECT_EQ(json["other_lights"]["dome"]["results"].size(), kCurveSamples.size());
}

TEST(TruthChart, LeavesOutWhatLogarithmsCannotShow)
{
    auto results = withVolumes({volume(1, 1, 1, 10), volume(1, 4, 2, 10), volume(2, 4, 1, 10)});
    results[5].error.block_rmse = -0.001; // not to be told from 0
    const std::string script = truthScript("it's {a_b}", "a\nb", results, "out.svg");
    EXPECT_NE(script.find("terminal svg"), std::string::npos);
    EXPECT_NE(script.find("'{/:Bold it''s \\{a\\_b\\}}'"), std::string::npos) << script;
    EXPECT_NE(script.find("'voxels ×2'"), std::string::npos);
    EXPECT_EQ(script.find(" -0.1 "), std::string::npos);
    EXPECT_NE(script.find("polygon"), std::string::npos);
    // Without any curve there is no ground to compare with.
    EXPECT_EQ(truthScript("", "", {results.begin() + 4, results.end()}, "a.png").find("polygon"),
              std::string::npos);
}

} // namespace
} // namespace volcomp
