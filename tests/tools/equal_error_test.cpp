// SPDX-License-Identifier: Apache-2.0
#include "tools/chart/equal_error.h"

#include <cmath>

#include <gtest/gtest.h>

namespace volcomp {
namespace {

/// Curves whose tree takes `tree` seconds and a sample 0.1, with the error 2 / sqrt(samples).
CurveCost cost(double samples, double tree = 1)
{
    return {samples, tree + 0.1 * samples, 0.1 * samples, 2 / std::sqrt(samples)};
}

std::vector<CurveCost> measured(double tree = 1)
{
    return {cost(1, tree), cost(4, tree), cost(16, tree), cost(64, tree)};
}

TEST(EqualError, IsExactAtMeasurementsAndBetweenThemInLogarithms)
{
    for (const double samples : {4.0, 16.0, 64.0}) {
        const EqualError e = curvesAtError(measured(), cost(samples).error);
        EXPECT_NEAR(e.seconds, cost(samples).seconds, 1e-9);
        EXPECT_NEAR(e.samples, samples, 1e-9);
    }
    // Without a tree all is a power of the samples, so that every place between is exact.
    for (const double samples : {1.5, 8.0, 50.0}) {
        const EqualError e = curvesAtError(measured(0), cost(samples, 0).error);
        EXPECT_EQ(e.from, EqualError::From::between);
        EXPECT_NEAR(e.seconds, cost(samples, 0).seconds, 1e-9);
        EXPECT_NEAR(e.samples, samples, 1e-9);
    }
    // With a tree it is the geometric mean halfway.
    EXPECT_NEAR(curvesAtError(measured(), cost(8).error).seconds, std::sqrt(1.4 * 2.6), 1e-9);
}

TEST(EqualError, GoesOnWithTheSquareRootOfTheSamplesWhileTheTreeStaysWhatItIs)
{
    const EqualError e = curvesAtError(measured(), cost(1000).error);
    EXPECT_EQ(e.from, EqualError::From::beyond);
    EXPECT_NEAR(e.samples, 1000, 1e-6);
    EXPECT_NEAR(e.seconds, cost(1000).seconds, 1e-6);
}

TEST(EqualError, TheFewestSamplesAreABoundAndNoErrorIsNoTime)
{
    const EqualError e = curvesAtError(measured(), 5);
    EXPECT_EQ(e.from, EqualError::From::coarsest);
    EXPECT_EQ(e.seconds, 1.1);
    EXPECT_EQ(e.samples, 1);
    for (const double error : {0.0, -0.1})
        EXPECT_EQ(curvesAtError(measured(), error).from, EqualError::From::nothing);
    EXPECT_EQ(curvesAtError({}, 1).from, EqualError::From::nothing);
    EXPECT_EQ(curvesAtError({{64, 7, 6, -0.01}}, 1).from, EqualError::From::nothing);
}

TEST(EqualError, ABeatenMeasurementDoesNotCount)
{
    std::vector<CurveCost> curves = measured();
    curves.push_back({9, 3, 2, 1.5}); // slower and worse than 16 samples
    for (const double error : {1.6, 1.2, 0.6, 0.1})
        EXPECT_EQ(curvesAtError(curves, error).seconds, curvesAtError(measured(), error).seconds);
}

TEST(EqualError, TheLineEndsAtTheError)
{
    const std::vector<CurveCost> within = curvesDownTo(measured(), 0.7, 5);
    ASSERT_EQ(within.size(), 3u); // 1 and 4 samples, and the end
    EXPECT_EQ(within[1].error, 1);
    EXPECT_EQ(within[2].error, 0.7);
    const std::vector<CurveCost> beyond = curvesDownTo(measured(), 0.05, 5);
    ASSERT_EQ(beyond.size(), 9u);
    EXPECT_NEAR(beyond.back().error, 0.05, 1e-12);
    for (const CurveCost& c : beyond)
        EXPECT_NEAR(c.seconds, 1 + 0.1 * 4 / (c.error * c.error), 1e-6);
    EXPECT_TRUE(curvesDownTo(measured(), 3, 5).empty());
}

} // namespace
} // namespace volcomp
