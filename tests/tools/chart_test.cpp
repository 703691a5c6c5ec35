// SPDX-License-Identifier: Apache-2.0
#include "tools/chart/chart.h"

#include <cmath>
#include <fstream>

#include <gtest/gtest.h>

#include "tools/chart/results.h"
#include "volcomp/base/random.h"

using namespace volcomp;

namespace {

bool overlap(const LabelBox& a, const LabelBox& b)
{
    return a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height
        && b.y < a.y + a.height;
}

} // namespace

TEST(Chart, TheFrontHoldsWhatNothingBeats)
{
    const std::vector<ChartPoint> points{{"slow", 9, 0.1},         {"fast", 1, 1},
                                         {"beaten", 5, 0.6},       {"middle", 4, 0.5},
                                         {"as fast, worse", 1, 2}, {"fast again", 1, 1}};
    EXPECT_EQ(paretoFront(points), (std::vector<std::size_t>{1, 3, 0}));
    EXPECT_TRUE(paretoFront({}).empty());
    Random random(2);
    std::vector<ChartPoint> many;
    for (int i = 0; i < 300; ++i)
        many.push_back({"", random.uniform(0.1, 1), random.uniform(0.1, 1)});
    const auto front = paretoFront(many);
    for (std::size_t i = 0; i < many.size(); ++i) {
        bool beaten = false, on_front = std::find(front.begin(), front.end(), i) != front.end();
        for (const ChartPoint& other : many)
            beaten |= other.x <= many[i].x && other.y <= many[i].y
                && (other.x < many[i].x || other.y < many[i].y);
        EXPECT_NE(beaten, on_front);
    }
}

TEST(Chart, TheCheapestWithinALimit)
{
    const std::vector<ChartPoint> points{{"", 9, 0.1}, {"", 1, 1}, {"", 4, 0.5}};
    EXPECT_EQ(cheapestWithin(points, 0.5), 2);
    EXPECT_EQ(cheapestWithin(points, 0.2), 0);
    EXPECT_EQ(cheapestWithin(points, 0.01), -1);
}

TEST(Chart, NamesNeitherOverlapNorLeaveTheFrame)
{
    Random random(6);
    const LabelBox frame{50, 20, 900, 500};
    std::vector<std::array<double, 2>> marks;
    std::vector<std::string> names;
    for (int i = 0; i < 30; ++i) { // a crowd in the middle, some at the borders
        const double spread = i < 20 ? 0.15 : 0.5;
        marks.push_back(
            {500 + 900 * spread * random.symmetric(), 270 + 500 * spread * random.symmetric()});
        names.push_back(i % 7 == 0 ? "" : "setting " + std::to_string(i));
    }
    const auto boxes = placeLabels(marks, names, frame, 8, 16);
    ASSERT_EQ(boxes.size(), marks.size());
    for (std::size_t i = 0; i < boxes.size(); ++i) {
        if (names[i].empty()) continue;
        EXPECT_EQ(boxes[i].width, 8.0 * double(names[i].size()));
        EXPECT_TRUE(boxes[i].x >= frame.x && boxes[i].x + boxes[i].width <= frame.x + frame.width
                    && boxes[i].y >= frame.y
                    && boxes[i].y + boxes[i].height <= frame.y + frame.height);
        for (std::size_t k = 0; k < i; ++k)
            if (!names[k].empty()) {
                EXPECT_FALSE(overlap(boxes[i], boxes[k])) << names[i] << " and " << names[k];
            }
    }
}

TEST(Chart, WhatIsApartIsNotOnTheFront)
{
    ChartPanel panel;
    panel.front = true;
    panel.series = {{"own", false, false, {{"", 3, 2}}, false},
                    {"other light", false, false, {{"", 1, 1}}, true}};
    const auto front = [&] {
        const std::string script = gnuplotScript({panel}, 800, 600, "out.svg");
        const std::size_t at = script.find("$front0 << END\n");
        return at == std::string::npos
            ? ""
            : script.substr(at + 15, script.find("END", at + 15) - at - 15);
    };
    EXPECT_EQ(front(), "3 2\n");
    panel.series[1].apart = false;
    EXPECT_EQ(front(), "1 1\n");
}

TEST(Chart, OtherLightIsNoChoiceOfSettings)
{
    const nlohmann::json four = {{"samples", 4}};
    std::vector<Result> radiance{{{"sweep, 4", kOwnLightFamily, {}}, four, 0.05, 2.0, 0.04},
                                 {{"multiple, 4", "multiple", {}}, four, 0.03, 1.5, 0.02, true}};
    const std::string tables = choiceTables(radiance, {});
    EXPECT_NE(tables.find("| 0.1 | sweep, 4 | 0.05 | 2.00 |"), std::string::npos) << tables;
    EXPECT_NE(tables.find("| multiple, 4 | 0.03 | 0.02 | 1.50 | 0.75 |"), std::string::npos)
        << tables;
    radiance.pop_back();
    EXPECT_EQ(choiceTables(radiance, {}).find("other light"), std::string::npos);
}

TEST(Chart, TheScriptQuotesNamesAndLeavesOutWhatLogsCannotShow)
{
    ChartPanel panel;
    panel.title = "it's";
    panel.series = {{"a", false, false, {{"one's", 1, 2}, {"zero", 0, 1}, {"nan", 1, NAN}}}};
    const std::string script = gnuplotScript({panel, ChartPanel()}, 800, 600, "out.svg");
    EXPECT_NE(script.find("terminal svg"), std::string::npos);
    EXPECT_NE(script.find("'one''s'"), std::string::npos);
    EXPECT_NE(script.find("'it''s'"), std::string::npos);
    EXPECT_EQ(script.find("zero"), std::string::npos);
    EXPECT_EQ(script.find("nan"), std::string::npos);
}
