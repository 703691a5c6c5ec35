// SPDX-License-Identifier: Apache-2.0
#include "volcomp/place/voxel_size.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/grounds.h"

namespace volcomp {
namespace {

TEST(VoxelSize, theVoxelFollowsTheNearestVisiblePoint)
{
    const Surface low = ground(4, 0), high = ground(1, 2);
    const Camera c = above(5);
    const double at0 = 2 * 5 * std::tan(c.field_of_view / 2) / 640, at2 = at0 * 3 / 5;
    EXPECT_NEAR(voxelFromCamera({&low}, c, 640, 480, 0.5), 0.5 * at0, 1e-9);
    EXPECT_NEAR(voxelFromCamera({&low, &high}, c, 640, 480, 0.5), 0.5 * at2, 1e-9);
    EXPECT_NEAR(voxelFromCamera({&low}, c, 1280, 480, 2), at0, 1e-9);
    // What another surface hides does not count: from below the lower one hides the upper one.
    Camera below = above(-3);
    below.target = Vec3d(0, 10, 0);
    EXPECT_NEAR(voxelFromCamera({&low, &high}, below, 640, 480, 0.5), 0.5 * at0 * 3 / 5, 1e-9);
    Camera away = above(5);
    away.target = Vec3d(0, 10, 0);
    EXPECT_EQ(voxelFromCamera({&low, &high}, away, 640, 480, 0.5), 0);
    // A needle has next to no area, but its tip counts.
    Mesh needle;
    needle.points = {{0, 4, 0}, {1e-7, 0, 0}, {0, 0, 1e-7}};
    needle.triangles = {{0, 1, 2}};
    prepareMesh(needle, 1, Vec3d(0.0), Orientation::file);
    const Surface tip(std::move(needle), MapProjection{});
    EXPECT_NEAR(voxelFromCamera({&low, &tip}, c, 640, 480, 0.5), 0.5 * at0 / 5, 1e-9);
}

} // namespace
} // namespace volcomp
