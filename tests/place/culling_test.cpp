// SPDX-License-Identifier: Apache-2.0
#include "volcomp/place/culling.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/grounds.h"

namespace volcomp {
namespace {

struct Start {
    Start() { openvdb::initialize(); }
} start;

std::size_t countKept(const std::vector<Placement>& placements, const std::vector<Box>& boxes,
                      const Camera& camera, const std::vector<Light>& lights)
{
    PlacementList list{placements, {}, {}};
    cullPlacements(list, boxes, camera, 640, 480, lights);
    return list.size();
}

// A ball that touches one of the picture's four planes is in view, one that is just beyond it is
// not, and neither is one behind the eye.
TEST(Culling, ABallIsInViewAsFarAsItReaches)
{
    const double radius = 0.3;
    for (const Projection projection : {Projection::perspective, Projection::orthographic}) {
        Camera c;
        c.eye = Vec3d(1, 2, 3);
        c.target = Vec3d(2, 2.5, 1);
        c.projection = projection;
        const Vec3d forward = (c.target - c.eye).unit(), right = forward.cross(c.up).unit(),
                    up = right.cross(forward);
        for (const double side : {-1.0, 1.0})
            for (const bool upright : {false, true}) {
                const double aspect = upright ? 480.0 / 640 : 1,
                             slope = std::tan(c.field_of_view / 2) * aspect;
                const Vec3d across = side * (upright ? up : right);
                const bool fan = projection == Projection::perspective;
                const Vec3d border = c.eye + 3.0 * forward
                    + across * (fan ? 3 * slope : 0.5 * c.width * aspect),
                            outwards = fan ? (across - slope * forward).unit() : across;
                EXPECT_TRUE(mayBeInView(c, 640, 480, border + 0.99 * radius * outwards, radius))
                    << fan << side << upright;
                EXPECT_FALSE(mayBeInView(c, 640, 480, border + 1.01 * radius * outwards, radius))
                    << fan << side << upright;
            }
        EXPECT_TRUE(mayBeInView(c, 640, 480, c.eye - 0.99 * radius * forward, radius));
        EXPECT_FALSE(mayBeInView(c, 640, 480, c.eye - 1.01 * radius * forward, radius));
    }
}

TEST(Culling, boxesOutOfThePictureAreCulledUnlessTheyThrowAShadowIntoIt)
{
    const Camera c = above(5); // sees x and z up to about 1.8
    std::vector<Placement> p(4);
    p[1].position = Vec3d(10, 0, 0); // outside
    p[2].position = Vec3d(0, 20, 0); // behind the eye, but between the light and the picture
    p[3].position = Vec3d(1.7, 0, 0);
    Light sun;
    sun.direction = Vec3d(0, -1, 0);
    PlacementList list{p, {10, 11, 12, 13}, {}}; // the triangles go with their boxes
    EXPECT_EQ(cullPlacements(list, {dot(0.01)}, c, 640, 480, {sun}), 1u);
    ASSERT_EQ(list.size(), 3u);
    EXPECT_EQ(list.placements[1].position[1], 20);
    EXPECT_EQ(list.triangles, (std::vector<std::int32_t>{10, 12, 13}));
    sun.direction = Vec3d(-1, 0, 0);
    EXPECT_EQ(countKept(p, {dot(0.01)}, c, {sun}),
              3u); // now the one at x = 10, and not the one above
    EXPECT_EQ(countKept(p, {dot(0.01)}, c, {}), 2u);
    Light lamp;
    lamp.kind = LightKind::point;
    lamp.position = Vec3d(12, 0, 0);
    EXPECT_EQ(countKept(p, {dot(0.01)}, c, {lamp}), 3u);
    lamp.position = Vec3d(10, 0.1, 0); // inside the box
    EXPECT_EQ(countKept(p, {dot(0.01)}, c, {lamp}), 3u);
}

TEST(Culling, boxesAreCulledAsLargeAsTheyStand)
{
    const Camera c = above(5);
    const Box big = dot(0.05);
    Box none = dot(0.05);
    none.volume.parts[0].density = openvdb::FloatGrid::create(0.0f);
    Light sun;
    sun.direction = Vec3d(-1, 0, 0);
    const auto kept = [&](const Placement& p, const std::vector<Light>& lights) {
        const std::vector<Placement> placements{Placement{}, p}; // one in the middle of the picture
        return countKept(placements, {big, none}, c, lights) == 2;
    };
    Placement p; // its box reaches 1 upwards; the picture's side is 1.82 from the middle
    p.position = Vec3d(2.7, 0, 0);
    EXPECT_FALSE(kept(p, {}));
    p.y_axis = Vec3f(-1, 0, 0);
    p.x_axis = Vec3f(0, 1, 0);
    EXPECT_TRUE(kept(p, {}));
    p.position = Vec3d(4.5, 0, 0);
    EXPECT_FALSE(kept(p, {}));
    p.scale = 4;
    EXPECT_TRUE(kept(p, {}));
    // A shadow goes one way, and is as wide as its box.
    p = Placement{};
    p.position = Vec3d(9, 0, 0);
    EXPECT_TRUE(kept(p, {sun}));
    p.position = Vec3d(-9, 0, 0);
    EXPECT_FALSE(kept(p, {sun}));
    p.position = Vec3d(9, 0, 0.9); // both balls have a radius of 0.5
    EXPECT_TRUE(kept(p, {sun}));
    p.position = Vec3d(9, 0, 1.2);
    EXPECT_FALSE(kept(p, {sun}));
    p.position = Vec3d(9, 0, 0);
    p.box = 1; // the box without voxels
    EXPECT_FALSE(kept(p, {sun}));
    Placement large;
    large.scale = 6;
    sun.direction = Vec3d(0, 1, 0);
    EXPECT_EQ(countKept({large, p}, {big, none}, c, {sun}), 1u);
}

TEST(Culling, ABoxsBallIsAroundTheCubesOfItsVoxels)
{
    const BoxBall ball = ballOf(dot(0.05)); // a column of 20 voxels, the first around the origin
    EXPECT_NEAR((ball.centre - Vec3d(0, 0.475, 0)).length(), 0, 1e-12);
    EXPECT_NEAR(ball.radius, std::sqrt(1 + 2 * 0.05 * 0.05) / 2, 1e-12);
    Box none = dot(0.05);
    none.volume.parts[0].density = openvdb::FloatGrid::create(0.0f);
    EXPECT_LT(ballOf(none).radius, 0);
}

TEST(Culling, TheRangeReachesFromTheNearestBallInViewToTheFarthest)
{
    const Camera c = above(5);
    const double radius = 0.8;
    const std::vector<BoxBall> balls{{Vec3d(0, 0.5, 0), radius}, {}};
    PlacementList list;
    const auto add = [&](const Vec3d& position, float scale, std::uint32_t box = 0) {
        Placement p;
        p.position = position;
        p.scale = scale;
        p.box = box;
        list.placements.push_back(p);
    };
    const auto expect = [&](double nearest, double farthest) {
        const ViewedRange range = viewedRange(list, balls, c, 640, 480);
        EXPECT_NEAR(range.nearest, nearest, 1e-12);
        EXPECT_NEAR(range.farthest, farthest, 1e-12);
    };
    expect(0, 0);
    add(Vec3d(0, 4, 0), 1, 1); // a box without voxels
    add(Vec3d(0, 20, 0), 1);   // behind the eye
    add(Vec3d(50, 0, 0), 1);   // outside
    expect(0, 0);
    add(Vec3d(0), 1);
    expect(4.5 - radius, 4.5 + radius);
    add(Vec3d(0, -5, 0), 2);
    expect(4.5 - radius, 9 + 2 * radius);
    add(Vec3d(0, 5, 0), 0.5f); // around the eye
    expect(0, 9 + 2 * radius);
}

} // namespace
} // namespace volcomp
