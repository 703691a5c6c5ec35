// SPDX-License-Identifier: Apache-2.0
#include "volcomp/inspect/placement_sheet.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/grounds.h"

namespace volcomp {
namespace {

/// A scene of these surfaces with one layer, on the first of them, and no boxes.
template <std::size_t N>
PlacedScene onGrounds(Surface (&&surfaces)[N])
{
    PlacedScene scene;
    for (Surface& s : surfaces)
        scene.surfaces.push_back({"ground", std::move(s), SkinSpec(), SecondDensity()});
    scene.layers.resize(1);
    return scene;
}

TEST(Sheet, panelsShowThePlacementsAndEachMap)
{
    PlacedScene scene = onGrounds({ground(4, 0)});
    Layer& l = scene.layers[0].layer;
    l.name = "grass";
    MapFactor half, green;
    half.constant = Vec3d(0.5);
    green.constant = Vec3d(0, 1, 0);
    l.where = {half};
    l.colour = {green};
    scene.boxes.placements.resize(1); // at the origin
    const Image image = placementSheet(scene, above(5), 64, 48);
    EXPECT_EQ(image.width, 3 * 64);
    EXPECT_GT(image.pixel(32, 24)[0], 0.5f);             // the first layer's dot is red
    EXPECT_NEAR(image.pixel(32, 36)[0], 0.3, 0.05);      // the bare surface
    EXPECT_NEAR(image.pixel(64 + 32, 24)[0], 0.5, 0.05); // the map
    EXPECT_GT(image.pixel(128 + 32, 24)[1], 0.9f);
    EXPECT_EQ(image.pixel(128 + 32, 24)[0], 0);
    int red = 0, pale = 0; // the layer's name in its colour, and the map's
    for (int y = 0; y < 16; ++y)
        for (int x = 0; x < 64; ++x) {
            const float *a = image.pixel(x, y), *b = image.pixel(64 + x, y);
            red += a[0] > 0.6f && a[1] < 0.3f;
            pale += b[0] > 0.75f && b[1] > 0.75f;
        }
    EXPECT_GT(red, 20);
    EXPECT_GT(pale, 20);
}

TEST(Sheet, panelsShowWhatIsInFront)
{
    std::vector<Placement> p(3);
    p[0].position = Vec3d(0, 0, 0);       // hidden by the upper surface
    p[1].position = Vec3d(1.2, 0, -0.6);  // to the right and above, as the camera's up is -Z
    p[2].position = Vec3d(1.2, 10, -0.6); // behind the eye
    for (const bool low_first : {true, false}) {
        PlacedScene scene = low_first ? onGrounds({ground(4, 0), ground(1, 2)})
                                      : onGrounds({ground(1, 2), ground(4, 0)});
        scene.layers[0].surface = low_first ? 0 : 1;
        scene.layers[0].layer.name = "a";
        MapFactor white;
        white.constant = Vec3d(1);
        scene.layers[0].layer.where = {white};
        scene.boxes.placements = p;
        const Image image = placementSheet(scene, above(5), 64, 48);
        ASSERT_EQ(image.width, 2 * 64);
        const auto isRed = [&](int x, int y) {
            return image.pixel(x, y)[0] > 0.6f && image.pixel(x, y)[1] < 0.3f;
        };
        const double per_metre = 64 / (2 * 5 * std::tan(above(5).field_of_view / 2));
        const int x = int(32 + 1.2 * per_metre), y = int(24 - 0.6 * per_metre);
        EXPECT_TRUE(isRed(x, y));
        int red = 0; // below the layer's name
        for (int j = 17; j < 48; ++j)
            for (int i = 0; i < 64; ++i) red += isRed(i, j);
        EXPECT_EQ(red, 0);
        EXPECT_NEAR(image.pixel(32, 24)[0], 0.3, 0.02);
        // The layer's own surface alone shows the map; what stands before it is dark.
        EXPECT_LT(image.pixel(64 + 32, 24)[0], 0.1f);
        EXPECT_GT(image.pixel(64 + x, 40)[0], 0.8f);
    }
}

// Two triangles of 20 m below the eye: one corner of each lies behind it, and one just before it.
TEST(Sheet, trianglesThatReachBehindTheEyeAreCut)
{
    for (const double ahead : {0.7, 10.0, 10 + 1e-11}) {
        PlacedScene scene = onGrounds({ground(20, 0)});
        scene.layers[0].layer.name = "a";
        Camera c;
        c.eye = Vec3d(0, 1.5, 10 - ahead);
        c.target = Vec3d(0, 0, 10 - ahead - 3);
        const Image image = placementSheet(scene, c, 64, 48);
        for (int x = 1; x < 64; x += 3) {
            EXPECT_GT(image.pixel(x, 40)[0], 0.07f) << x; // the ground, seen from above
            EXPECT_GT(image.pixel(64 + x, 40)[0], 0.25f) << x;
        }
    }
}

TEST(Sheet, anOrthographicCameraSeesDepthEvenly)
{
    // A slope from y = 0 to 4 along x that stands through a plane at y = 2: the line where they
    // meet is x = 0.
    Mesh slope;
    slope.points = {{-2, 0, -2}, {2, 4, -2}, {2, 4, 2}, {-2, 0, 2}};
    slope.triangles = {{0, 2, 1}, {0, 3, 2}};
    prepareMesh(slope, 1, Vec3d(0.0), Orientation::outward);
    PlacedScene scene = onGrounds({Surface(std::move(slope), MapProjection{}), ground(4, 2)});
    MapFactor white;
    white.constant = Vec3d(1);
    scene.layers[0].layer.where = {white};
    Camera c = above(20);
    c.projection = Projection::orthographic;
    c.width = 4;
    const Image image = placementSheet(scene, c, 64, 48);
    for (int x = 2; x < 62; ++x)
        if (x < 30 || x > 33) {
            EXPECT_EQ(image.pixel(64 + x, 40)[0] > 0.2f, x > 32) << x;
        }
}

} // namespace
} // namespace volcomp
