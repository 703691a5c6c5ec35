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
    EXPECT_EQ(said[0], "10 % after 60 s");
    EXPECT_EQ(said[8], "90 % after 540 s");
    EXPECT_EQ(linesOf(36000).size(), 9u);
}

TEST(ProgressLines, NoneInTheFirstFiveSeconds)
{
    EXPECT_TRUE(linesOf(4.9).empty());
    const std::vector<std::string> said = linesOf(10);
    ASSERT_EQ(said.size(), 5u); // at 5 s it is at 50 %
    EXPECT_EQ(said[0], "50 % after 5 s");
}

TEST(ProgressLines, OfSeveralAtOnceOnlyTheLast)
{
    ProgressLines lines;
    EXPECT_EQ(lines.next(0.05, 100), std::nullopt);
    EXPECT_EQ(lines.next(0.38, 110), "30 % after 110 s");
    EXPECT_EQ(lines.next(0.39, 111), std::nullopt);
    EXPECT_EQ(lines.next(0.4, 112), "40 % after 112 s");
    EXPECT_EQ(lines.next(1, 200), std::nullopt) << "the end of the stage has its own line";
}
