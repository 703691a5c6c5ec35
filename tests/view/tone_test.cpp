// SPDX-License-Identifier: Apache-2.0
// The filmic curve at values that were worked out from its formula, and its shape.
#include "volcomp/view/tone.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "volcomp/base/error.h"

using namespace volcomp;

TEST(Tone, FilmicHasTheValuesOfItsFormula)
{
    EXPECT_EQ(filmic(0), 0);
    EXPECT_NEAR(filmic(0.18), 0.18, 1e-12) << "mid grey stays";
    EXPECT_NEAR(filmic(0.5), 0.401801, 1e-6);
    EXPECT_NEAR(filmic(1), 0.612947, 1e-6);
    EXPECT_NEAR(filmic(2), 0.830687, 1e-6);
    EXPECT_NEAR(filmic(kFilmicWhite * (1 - 1e-9)), 1, 1e-8);
    EXPECT_NEAR(filmic(1e-6), 1.121456e-6, 1e-10);
    for (const double white : {kFilmicWhite, 1e30, std::numeric_limits<double>::infinity()})
        EXPECT_EQ(filmic(white), 1);
    for (const double black : {-1.0, -1e30, std::nan("")}) EXPECT_EQ(filmic(black), 0);
}

TEST(Tone, FilmicRisesAndNeverFaster)
{
    double before = 0, slope = 2;
    for (double x = 0.001; x < kFilmicWhite; x += 0.001) {
        const double now = filmic(x), rise = (now - before) / 0.001;
        EXPECT_GT(now, before) << x;
        if (x > 0.3) {
            EXPECT_LT(rise, slope + 1e-9) << x;
        }
        slope = rise;
        before = now;
    }
}

// A colour far above white goes towards white instead of clipping to a pure colour.
TEST(Tone, BrightColoursLoseTheirColour)
{
    const Look film{0, Tone::filmic};
    double before = 1;
    for (const double bright : {0.2, 1.0, 4.0, 20.0}) {
        const double red = film.shown(bright), green = film.shown(0.25 * bright),
                     saturation = (red - green) / red;
        EXPECT_LT(saturation, before);
        before = saturation;
    }
    EXPECT_EQ(before, 0);
}

TEST(Tone, ExposureIsInStops)
{
    EXPECT_EQ(Look().shown(0.7), 0.7);
    EXPECT_DOUBLE_EQ((Look{1, Tone::none}.shown(0.7)), 1.4);
    EXPECT_DOUBLE_EQ((Look{-2, Tone::none}.shown(0.7)), 0.175);
    EXPECT_DOUBLE_EQ((Look{1, Tone::filmic}.shown(0.7)), filmic(1.4));
    EXPECT_THROW((Look{101, Tone::none}.validate()), Error);
    EXPECT_THROW((Look{std::nan(""), Tone::none}.validate()), Error);
}
