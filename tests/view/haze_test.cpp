// SPDX-License-Identifier: Apache-2.0
// The optical depth of haze along rays against sums of small steps, and at its limits.
#include "volcomp/view/haze.h"

#include <cmath>

#include <gtest/gtest.h>

#include "volcomp/base/error.h"
#include "volcomp/base/interval.h"

using namespace volcomp;

namespace {

Haze haze(double density, double height, double base = 0)
{
    Haze h;
    h.density = density;
    h.height = height;
    h.base = base;
    return h;
}

double summed(const Haze& h, const Vec3d& origin, const Vec3d& direction, double distance)
{
    constexpr int kSteps = 200000;
    double sum = 0;
    for (int i = 0; i < kSteps; ++i) {
        const double y = origin[1] + direction[1] * distance * (i + 0.5) / kSteps;
        sum += h.density * (h.height > 0 ? std::exp(-(y - h.base) / h.height) : 1);
    }
    return sum * distance / kSteps;
}

} // namespace

TEST(Haze, DepthIsTheSumOfTheDensity)
{
    const Vec3d origin(3, 12, -5);
    for (const Haze& h : {haze(0.02, 0), haze(0.02, 10), haze(0.3, 2, 11), haze(0.001, 500, -40)})
        for (const Vec3d& way : {Vec3d(1, 0, 0), Vec3d(0.3, 1, 0), Vec3d(0.3, -1, 0),
                                 Vec3d(0, -1, 0), Vec3d(1, 1e-9, 0), Vec3d(1, -1e-14, 0)})
            for (const double distance : {0.5, 20.0}) {
                const Vec3d d = way.unit();
                const double expected = summed(h, origin, d, distance),
                             found = HazeRay(h, origin, d).depth(distance);
                EXPECT_NEAR(found / expected, 1, 1e-8) << h.height << ' ' << way;
                EXPECT_EQ(HazeRay(h, origin, d).transmittance(distance), std::exp(-found));
            }
}

TEST(Haze, RaysWithoutEndHaveAClosedFormToo)
{
    // Straight up from the base there is density x height; at 30 degrees twice as much.
    EXPECT_NEAR(HazeRay(haze(0.02, 10, 7), {0, 7, 0}, {0, 1, 0}).depth(kInfinity), 0.2, 1e-12);
    EXPECT_NEAR(
        HazeRay(haze(0.02, 10, 7), {0, 7, 0}, Vec3d(std::sqrt(0.75), 0.5, 0)).depth(kInfinity), 0.4,
        1e-12);
    for (const Vec3d& d : {Vec3d(1, 0, 0), Vec3d(0, -1, 0), Vec3d(0.8, -0.6, 0)})
        EXPECT_EQ(HazeRay(haze(0.02, 10), {0, 0, 0}, d).transmittance(kInfinity), 0) << d;
    EXPECT_EQ(HazeRay(haze(0.02, 0), {0, 0, 0}, {0, 1, 0}).transmittance(kInfinity), 0);
    EXPECT_EQ(HazeRay(haze(0, 10), {0, 0, 0}, {0, -1, 0}).transmittance(kInfinity), 1);
    EXPECT_EQ(HazeRay().transmittance(kInfinity), 1);
}

TEST(Haze, IsNeverNanAndNeverLessFartherAway)
{
    for (const double density : {0.0, 1e-300, 0.1, 1e300})
        for (const double height : {0.0, 1e-300, 1.0, 1e300})
            for (const double y : {-1e300, -1e5, 0.0, 1e5, 1e300})
                for (const double rise : {-1.0, -1e-300, 0.0, 1e-300, 1.0}) {
                    const HazeRay ray(haze(density, height), {0, y, 0},
                                      {std::sqrt(1 - rise * rise), rise, 0});
                    double before = 0;
                    for (const double distance : {0.0, 1e-300, 1.0, 1e5, 1e300, kInfinity}) {
                        const double depth = ray.depth(distance);
                        EXPECT_FALSE(std::isnan(depth)) << density << ' ' << height << ' ' << y
                                                        << ' ' << rise << ' ' << distance;
                        EXPECT_GE(depth, before * (1 - 1e-12));
                        before = depth;
                    }
                }
}

TEST(Haze, ValuesOutOfRangeAreErrors)
{
    const double nan = std::nan("");
    EXPECT_NO_THROW(Haze().validate());
    for (const Haze& h :
         {haze(-1, 0), haze(nan, 0), haze(1, -1), haze(1, kInfinity), haze(1, 1, kInfinity)})
        EXPECT_THROW(h.validate(), Error);
    Haze dark;
    dark.colour = Vec3d(-1, 0, 0);
    EXPECT_THROW(dark.validate(), Error);
}
