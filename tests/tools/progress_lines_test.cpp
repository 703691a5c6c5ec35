// SPDX-License-Identifier: Apache-2.0
#include "tools/shared/progress_lines.h"

#include <vector>

#include <gtest/gtest.h>

using namespace volcomp;

namespace {

/// The lines of a stage of so many seconds that reports a thousand times, evenly.
std::vector<std::string> linesOf(double seconds)
{
    ProgressLines lines;
    std::vector<std::string> said;
    for (int i = 0; i <= 1000; ++i)
        if (const auto line = lines.next(i / 1000.0, seconds * i / 1000)) said.push_back(*line);
    return said;
}

} // namespace

TEST(ProgressLines, OneForEachTenPerCent)
{
    const std::vector<std::string> said = linesOf(600);
    ASSERT_EQ(said.size(), 9u);
    EXPECT_EQ(said[0], "10 % after 60 s: 0.2 %/s, 9 min 0 s left");
    EXPECT_EQ(said[8], "90 % after 540 s: 0.2 %/s, 1 min 0 s left");
    EXPECT_EQ(linesOf(36000).size(), 9u);
}

TEST(ProgressLines, NoneInTheFirstFiveSeconds)
{
    EXPECT_TRUE(linesOf(4.9).empty());
    const std::vector<std::string> said = linesOf(10);
    ASSERT_EQ(said.size(), 5u); // at 5 s it is at 50 %
    EXPECT_EQ(said[0], "50 % after 5 s: 10.0 %/s, 5 s left");
}

TEST(ProgressLines, OfSeveralAtOnceOnlyTheLast)
{
    ProgressLines lines;
    EXPECT_EQ(lines.next(0.05, 100), std::nullopt);
    EXPECT_EQ(lines.next(0.38, 110), "30 % after 110 s: 0.3 %/s, 2 min 59 s left");
    EXPECT_EQ(lines.next(0.39, 111), std::nullopt);
    EXPECT_EQ(lines.next(0.4, 112), "40 % after 112 s: 0.4 %/s, 2 min 48 s left");
    EXPECT_EQ(lines.next(1, 200), std::nullopt) << "the end of the stage has its own line";
}

TEST(ProgressLines, PaceAndTimeLeftOfAnEvenStage)
{
    EXPECT_EQ(paceText(0.25, 10), "2.5 %/s, 30 s left");
    EXPECT_EQ(paceText(0.01, 7200), "0.0083 %/min, 198 h 0 min left");
    EXPECT_EQ(paceText(1, 5), "20.0 %/s, 0 s left");
    EXPECT_EQ(timeText(59.4), "59 s");
    EXPECT_EQ(timeText(3599.6), "1 h 0 min");
}
