// SPDX-License-Identifier: Apache-2.0
#include "volcomp/base/ray_box.h"

#include <gtest/gtest.h>

#include "volcomp/base/random.h"

using namespace volcomp;

namespace {

bool inside(const Vec3d& p, const Vec3d& low, const Vec3d& high)
{
    return p[0] >= low[0] && p[0] < high[0] && p[1] >= low[1] && p[1] < high[1] && p[2] >= low[2]
        && p[2] < high[2];
}

} // namespace

// Points along random lines are in the range exactly if they are in the box.
TEST(RayBox, ARangeHasThePointsInTheBox)
{
    Random random(1);
    const auto vector = [&](double size) {
        const double x = random.symmetric(), y = random.symmetric(), z = random.symmetric();
        return Vec3d(x, y, z) * size;
    };
    int hits = 0;
    for (int i = 0; i < 2000; ++i) {
        const Vec3d low = vector(1), high = low + Vec3d(0.5, 1, 1.5), origin = vector(1.5);
        Vec3d direction = vector(2);
        if (i % 3 == 0) direction[i % 2] = 0; // along a plane of the axes
        const LineRange range = clippedToBox({-1, 2}, origin, direction, low, high);
        hits += range.begin < range.end;
        for (double t = -0.995; t < 2; t += 0.01) {
            if (std::abs(t - range.begin) < 1e-9 || std::abs(t - range.end) < 1e-9) continue;
            EXPECT_EQ(t > range.begin && t < range.end, inside(origin + direction * t, low, high))
                << i << ' ' << t;
        }
    }
    EXPECT_GT(hits, 200) << "of 2000 lines";
}

TEST(RayBox, ALineInAFaceIsInsideAtTheLowOne)
{
    const Vec3d low(0.0), high(1.0), along(0, 0, 1);
    const LineRange at_low = clippedToBox({-9, 9}, Vec3d(0, 0.5, 0), along, low, high);
    EXPECT_EQ(at_low.begin, 0);
    EXPECT_EQ(at_low.end, 1);
    const LineRange at_high = clippedToBox({-9, 9}, Vec3d(1, 0.5, 0), along, low, high);
    EXPECT_GE(at_high.begin, at_high.end);
}

TEST(Axes, TheFirstOfEqualOnesIsTaken)
{
    EXPECT_EQ(largestAxis(Vec3d(1, -3, 2)), 1) << "by magnitude";
    EXPECT_EQ(largestAxis(Vec3d(2, -2, 2)), 0);
    EXPECT_EQ(largestAxis(Vec3d(1, 2, -2)), 1);
    EXPECT_EQ(largestAxis(Vec3d(0, 1, 2)), 2);
    EXPECT_EQ(smallestOf({3, 1, 1}), 1);
    EXPECT_EQ(smallestOf({1, 1, 1}), 0);
    EXPECT_EQ(smallestOf({3, 2, 1}), 2);
    EXPECT_NEAR(kGoldenAngle, kPi * (3 - std::sqrt(5.0)), 1e-15);
}
