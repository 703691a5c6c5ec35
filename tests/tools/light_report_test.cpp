// SPDX-License-Identifier: Apache-2.0
// The lines that say why a picture is dark.
#include "tools/render/light_report.h"

#include <gtest/gtest.h>

using namespace volcomp;

namespace {

std::vector<Light> lights()
{
    std::vector<Light> list(3);
    list[0].name = "sun";
    list[2].name = "rim";
    return list;
}

RenderStats stats()
{
    RenderStats s;
    s.rays = 10;
    s.lights = {{0.7125, 0.4812}, {0, -1}, {0.0213, 0.00712}};
    s.ambient_seen = 0.2662;
    return s;
}

} // namespace

TEST(LightReport, SaysWhatArrives)
{
    EXPECT_EQ(lightReport(lights(), stats()),
              (std::vector<std::string>{
                  "light seen: sun 71 % (48 % arrives), light2 0 %, rim 2.1 % (0.71 % arrives), "
                  "ambient 27 %",
                  "light 'light2' shines on nothing that the picture shows",
                  "only 0.71 % of light 'rim' arrives: something stands before it, or what it "
                  "shines on lies deep in the shade of others"}));
}

TEST(LightReport, SaysThatNothingArrives)
{
    RenderStats dark = stats();
    dark.lights[2].arrives = 0;
    EXPECT_EQ(lightReport(lights(), dark).back().substr(0, 33),
              "nothing of light 'rim' arrives: s");
}

TEST(LightReport, SaysNothingWithoutRaysOrLight)
{
    RenderStats none;
    none.lights.resize(3);
    EXPECT_TRUE(lightReport(lights(), none).empty()) << "a resumed render with nothing to do";
    none.rays = 1;
    none.lights.clear();
    EXPECT_TRUE(lightReport({}, none).empty());
}

TEST(LightReport, StatisticsHaveTheSame)
{
    const nlohmann::json found = lightStats(lights(), stats());
    EXPECT_EQ(found["ambient"]["seen"], 0.2662);
    ASSERT_EQ(found["lights"].size(), 3u);
    EXPECT_EQ(found["lights"][0],
              (nlohmann::json{{"name", "sun"}, {"seen", 0.7125}, {"arrives", 0.4812}}));
    EXPECT_TRUE(found["lights"][1]["arrives"].is_null());
}
