// SPDX-License-Identifier: Apache-2.0
#include "volcomp/inspect/layout.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/grounds.h"

namespace volcomp {
namespace {

/// A plane of 4 m seen from 5 m above, up is -Z, with one box kind of 0.5 m.
class Layout : public testing::Test {
protected:
    Layout()
    {
        m_scene.camera = above(5);
        m_scene.render.width = 160;
        m_scene.render.height = 120;
        GrowthRule rule;
        rule.name = "hair";
        rule.levels.resize(1);
        rule.levels[0].parent = "ground";
        rule.levels[0].length = 0.5;
        m_scene.boxes = {rule};
        PlacedScene& placed = m_places.placed;
        placed.surfaces.push_back({"ground", ground(4, 0), SkinSpec(), SecondDensity()});
        placed.layers.resize(1);
        placed.layers[0].layer.name = "fur";
        placed.layers[0].layer.box = "hair";
        m_places.parts = {1};
    }
    /// A box whose root is at p and whose axis is y.
    void place(const Vec3d& p, const Vec3f& y)
    {
        Placement placement;
        placement.position = p;
        placement.y_axis = y;
        m_places.placed.boxes.placements.push_back(placement);
        ++m_places.placed.layers[0].boxes;
    }
    Image draw() { return layoutPicture(m_scene, m_places); }
    /// Column and row of a point in the plane y = 0.
    std::pair<int, int> at(double x, double z) const
    {
        const double scale = 160 / (2 * 5 * std::tan(m_scene.camera.field_of_view / 2));
        const int margin = layoutMargin(160, 120);
        return {int(margin + 80 + x * scale), int(margin + 60 + z * scale)};
    }
    static bool isRed(const float* c) { return c[0] > 0.3f && c[1] < 0.5f * c[0]; }

    Scene m_scene;
    LayoutPlaces m_places;
};

TEST_F(Layout, strokesGoFromTheRootAlongTheAxis)
{
    place({0.2, 0, 0.1}, {1, 0, 0});
    const Image image = draw();
    const auto [x0, y0] = at(0.2, 0.1);
    const auto [x1, y1] = at(0.7, 0.1);
    ASSERT_EQ(y0, y1);
    for (int x = x0; x < x1; ++x) EXPECT_TRUE(isRed(image.pixel(x, y0))) << x;
    EXPECT_FALSE(isRed(image.pixel(x0 - 2, y0)));
    EXPECT_FALSE(isRed(image.pixel(x1 + 2, y0)));
    EXPECT_LT(image.pixel(x0, y0)[0], image.pixel(x1 - 1, y0)[0]) << "paler towards the tip";
}

TEST_F(Layout, whatASurfaceHidesIsNotDrawn)
{
    m_places.placed.surfaces.push_back({"roof", ground(1, 2), SkinSpec(), SecondDensity()});
    place({0, 0, 0}, {0, 1, 0});   // below the roof
    place({0, 2, 0.2}, {1, 0, 0}); // on it
    const Image image = draw();
    int red = 0;
    const auto [x, y] = at(0, 0);
    for (int i = -3; i <= 3; ++i) red += isRed(image.pixel(x + i, y - 3));
    EXPECT_EQ(red, 0);
    const auto [x2, y2] = at(0.2 * 5 / 3, 0.2 * 5 / 3);
    EXPECT_TRUE(isRed(image.pixel(x2, y2)));
}

TEST_F(Layout, frameIsThePictureAndItsMarginIsDark)
{
    const Image image = draw();
    const int margin = layoutMargin(160, 120);
    ASSERT_EQ(image.width, 160 + 2 * margin);
    ASSERT_EQ(image.height, 120 + 2 * margin);
    EXPECT_NEAR(image.pixel(margin - 1, margin + 60)[0], 0.95, 0.01);
    EXPECT_NEAR(image.pixel(margin + 160, margin + 60)[0], 0.95, 0.01);
    const auto [x, y] = at(0, 0);
    EXPECT_NEAR(image.pixel(x, y)[0], 0.3, 0.02);
    const auto [left, row] = at(-1.85, 0); // outside of the frame, which shows 1.82 m to each side
    ASSERT_LT(left, margin - 1);
    EXPECT_NEAR(image.pixel(left, row + 3)[0], 0.35 * 0.3, 0.02);
}

TEST_F(Layout, skinsShowTheirColourAndLightsTheirPlace)
{
    m_places.placed.surfaces[0].skin.material = "skin";
    m_places.placed.surfaces[0].skin.colour = Vec3d(0, 1, 0);
    Light lamp;
    lamp.name = "lamp";
    lamp.kind = LightKind::point;
    lamp.position = Vec3d(1, 0, 0.5);
    lamp.strength = Vec3d(0, 0, 7);
    m_scene.lights = {lamp};
    const Image image = draw();
    const auto [x, y] = at(0, 0);
    EXPECT_GT(image.pixel(x, y)[1], 0.7f);
    EXPECT_EQ(image.pixel(x, y)[0], 0);
    const auto [lx, ly] = at(1, 0.5);
    EXPECT_EQ(image.pixel(lx, ly)[2], 1);
    EXPECT_EQ(image.pixel(lx, ly)[1], 0);
}

TEST_F(Layout, ofVeryManyBoxesAPartIsDrawn)
{
    for (std::size_t i = 0; i <= kLayoutStrokes; ++i) // every second: the even ones
        place({i % 2 ? -1.0 : 1.0, 0, 0}, {1, 0, 0});
    const Image image = draw();
    const auto [x, y] = at(1.2, 0);
    const auto [hidden, same] = at(-0.8, 0);
    EXPECT_TRUE(isRed(image.pixel(x, y)));
    EXPECT_FALSE(isRed(image.pixel(hidden, same)));
}

} // namespace
} // namespace volcomp
