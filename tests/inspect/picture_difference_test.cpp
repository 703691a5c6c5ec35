// SPDX-License-Identifier: Apache-2.0
#include "volcomp/inspect/picture_difference.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/message_of.h"

namespace volcomp {
namespace {

/// A grey picture of R, G, B and A.
Image grey(int width, int height, float value)
{
    Image image;
    image.width = width;
    image.height = height;
    image.channels = {"R", "G", "B", "A"};
    image.pixels.assign(std::size_t(width) * height * 4, value);
    return image;
}

TEST(PictureDifference, ofAnEvenOffsetIsBias)
{
    const PictureDifference d = differenceOf(grey(16, 8, 0.55f), grey(16, 8, 0.5f));
    EXPECT_NEAR(d.mean_a, 0.55, 1e-6);
    for (const double value : {d.bias, d.rmse, d.block_rmse}) EXPECT_NEAR(value, 0.1, 1e-6);
    EXPECT_NEAR(d.alpha_rmse, 0.05, 1e-6);
    EXPECT_FALSE(d.equal);
}

TEST(PictureDifference, ofACheckIsGoneInBlocks)
{
    Image a = grey(17, 10, 0.5f); // the last column and the last two rows fill no block
    for (int y = 0; y < 10; ++y)
        for (int x = 0; x < 17; ++x)
            for (int c = 0; c < 3; ++c) a.pixel(x, y)[c] += (x + y) % 2 ? 0.1f : -0.1f;
    const PictureDifference d = differenceOf(a, grey(17, 10, 0.5f));
    EXPECT_NEAR(d.bias, 0, 1e-6);
    EXPECT_NEAR(d.rmse, 0.2, 1e-6);
    EXPECT_NEAR(d.block_rmse, 0, 1e-6);
    EXPECT_EQ(d.alpha_rmse, 0);
}

TEST(PictureDifference, findsTheWorstPixelsApartFromEachOther)
{
    Image a = grey(64, 48, 0.5f);
    const Image b = a;
    a.pixel(10, 20)[0] = 1.5f;
    a.pixel(11, 20)[0] = 1.4f; // near the worst
    a.pixel(50, 7)[1] = 0.1f;
    const PictureDifference d = differenceOf(a, b);
    ASSERT_EQ(d.worst.size(), 2u);
    EXPECT_EQ(d.worst[0].x, 10);
    EXPECT_EQ(d.worst[0].y, 20);
    EXPECT_NEAR(d.worst[0].difference, 1 / std::sqrt(3.0), 1e-6);
    EXPECT_EQ(d.worst[0].a[0], 1.5f);
    EXPECT_EQ(d.worst[1].x, 50);
    EXPECT_NEAR(d.worst[1].difference, 0.4 / std::sqrt(3.0), 1e-6);
}

TEST(PictureDifference, ofEqualAndBlackPictures)
{
    EXPECT_TRUE(differenceOf(grey(4, 4, 0.3f), grey(4, 4, 0.3f)).equal);
    const PictureDifference d = differenceOf(grey(4, 4, 0.3f), grey(4, 4, 0));
    EXPECT_NEAR(d.rmse, 0.3, 1e-6) << "as it is";
    EXPECT_NE(messageOf([] {
                  differenceOf(grey(4, 4, 0), grey(4, 5, 0));
              }).find("4 x 4 and 4 x 5 pixels"),
              std::string::npos);
    Image other = grey(4, 4, 0);
    other.channels[1] = "Y";
    EXPECT_NE(messageOf([&] { differenceOf(grey(4, 4, 0), other); }).find("channel 'G'"),
              std::string::npos);
}

TEST(PictureDifference, pictureIsRedWhereAIsBrighter)
{
    Image a = grey(40, 90, 0.5f);
    for (int y = 0; y < 90; ++y)
        for (int c = 0; c < 3; ++c) {
            a.pixel(5, y)[c] = 0.7f;
            a.pixel(30, y)[c] = 0.3f;
        }
    const Image image = differencePicture(a, grey(40, 90, 0.5f), "a", "b", 2);
    ASSERT_EQ(image.width, 3 * 40 + 8);
    const int top = image.height - 90, left = 2 * 44;
    EXPECT_NEAR(image.pixel(5, top + 15)[0], 0.7, 1e-6);
    EXPECT_NEAR(image.pixel(44 + 5, top + 15)[0], 0.5, 1e-6);
    EXPECT_NEAR(image.pixel(left + 5, top + 89)[0], 2 * 0.2, 1e-5);
    EXPECT_LT(image.pixel(left + 5, top + 89)[2], 0.1f);
    EXPECT_NEAR(image.pixel(left + 30, top + 89)[2], 2 * 0.2, 1e-5);
    EXPECT_EQ(image.pixel(left + 20, top + 89)[0], 0);
}

} // namespace
} // namespace volcomp
