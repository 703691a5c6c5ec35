// SPDX-License-Identifier: Apache-2.0
#include "volcomp/inspect/box_sheet.h"

#include <cmath>

#include <gtest/gtest.h>

#include "volcomp/bake/bake.h"
#include "volcomp/base/error.h"

namespace volcomp {
namespace {

Box boxOf(double count)
{
    GrowthLevel level;
    level.name = "stem";
    level.parent = "ground";
    level.count = {count, count};
    level.length = 2;
    level.radius = 0.3;
    GrowthRule p;
    p.name = "post";
    p.material = "bark";
    p.levels = {level};
    p.voxel = 0.1;
    return bake(p, {Material{"bark"}}, 1);
}

TEST(Sheet, ABoxStandsInTheMiddleOfItsPicture)
{
    const BoxThumbnail tile = renderBoxThumbnail(boxOf(1), {Material{"bark"}}, {}, 64);
    EXPECT_EQ(tile.title, "post 2");
    EXPECT_EQ(tile.subtitle.find("2.5 m high, 70 cm wide, "), 0U)
        << tile.subtitle; // tapered, with round ends, in whole voxels
    const float* sky = tile.picture.pixel(0, 0);
    for (int x : {2, 61}) EXPECT_EQ(tile.picture.pixel(x, 32)[2], sky[2]);
    EXPECT_GT(std::abs(tile.picture.pixel(32, 32)[2] - sky[2]), 0.05f);
    for (int y : {0, 63})
        EXPECT_EQ(tile.picture.pixel(32, y)[2], sky[2]) << "all of it is in the picture";
}

TEST(Sheet, LabelsAreWrittenBelowThePictures)
{
    const BoxThumbnail tile = renderBoxThumbnail(boxOf(1), {Material{"bark"}}, {}, 64);
    const Image sheet = contactSheet({tile, tile, tile});
    ASSERT_GE(sheet.width, 3 * 64);
    int dark = 0;
    for (int y = 0; y < sheet.height; ++y)
        for (int x = 0; x < sheet.width; ++x) {
            const float* p = sheet.pixel(x, y);
            EXPECT_EQ(p[3], 1) << "nothing of a sheet is transparent";
            dark += y > 4 + 64 && p[0] < 0.2f;
        }
    EXPECT_GT(dark, 100);
}

TEST(Sheet, NothingToShowIsAnErrorAndAnEmptyBoxIsNot)
{
    EXPECT_THROW(contactSheet({}), Error);
    EXPECT_EQ(renderBoxThumbnail(boxOf(0), {Material{"bark"}}, {}, 16).subtitle, "empty");
}

} // namespace
} // namespace volcomp
