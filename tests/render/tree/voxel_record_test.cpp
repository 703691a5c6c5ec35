// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/tree/voxel_record.h"

#include <gtest/gtest.h>

#include "volcomp/base/random.h"

namespace volcomp {
namespace {

// The errors that voxel_record.h promises, and a little rounding of floats.
TEST(VoxelRecord, KeepsWhatItIsGivenToThePrecisionThatItPromises)
{
    Random random(7);
    for (int i = 0; i < 20000; ++i) {
        const Vec3d direction = Vec3d(random.normal(), random.normal(), random.normal()).unit();
        const double spread = random.uniform();
        const float scale = float(0.1 + 3 * random.uniform());
        Vec3f colour;
        for (int c = 0; c < 3; ++c) colour[c] = float(scale * random.uniform());
        const int part = i % 15;
        const double own = random.uniform();
        const VoxelRecord record(Vec3f(direction * (1 - spread)), colour, scale, part, float(own));
        ASSERT_FALSE(record.isList());
        const VoxelContent c = record.content(0.25f, scale);
        EXPECT_EQ(c.part, part);
        EXPECT_EQ(c.density, 0.25f);
        EXPECT_NEAR(std::sqrt(c.own_share), std::sqrt(own), 0.0715);
        EXPECT_NEAR(spreadOf(c.spread_code), spread, 0.0081);
        for (int k = 0; k < 3; ++k) EXPECT_NEAR(c.colour[k], colour[k], 2.001e-3 * scale);
        if (spread > 0.99) continue; // too short for a direction in floats
        ASSERT_TRUE(c.directed);
        EXPECT_NEAR(c.direction.length(), 1, 1e-12);
        const double sine = c.direction.cross(direction).length();
        EXPECT_LT(sine, 7e-4) << direction;
    }
}

TEST(VoxelRecord, VoxelsWithoutADirection)
{
    for (const float bad : {0.0f, NAN, INFINITY}) {
        const VoxelRecord record(Vec3f(bad), Vec3f(0.5f), 1, 0);
        EXPECT_FALSE(record.directed());
        EXPECT_FALSE(record.content(1, 1).directed);
    }
    const VoxelRecord turned(Vec3f(0, 0, -1), Vec3f(0.0f), 0, 0);
    EXPECT_EQ(turned.direction(), Vec3d(0, 0, 1)); // sign free
    EXPECT_EQ(turned.content(1, 0).colour, Vec3d(0.0));
}

TEST(VoxelRecord, ListsOfAnySize)
{
    const VoxelRecord record = VoxelRecord::list(4294967295u, 65535);
    EXPECT_TRUE(record.isList());
    EXPECT_EQ(record.listStart(), 4294967295u);
    EXPECT_EQ(record.listCount(), 65535u);
}

// Particles in all directions stop as much light whatever their spread about a mean is: the mean of
// the factor over all rays is 1 for every code. Fibres that agree follow the sine, scaled by 4/pi,
// and sheets the cosine, scaled by 2.
TEST(DirectionFactors, HaveMeanOne)
{
    const DirectionFactors factors;
    for (const MaterialKind kind : {MaterialKind::fibre, MaterialKind::surface}) {
        for (int code = 0; code < kSpreadCodes; ++code) {
            constexpr int kSteps = 100000;
            double mean = 0; // cosines of random rays are uniform
            for (int i = 0; i < kSteps; ++i)
                mean += factors.at(kind, code, (i + 0.5) / kSteps) / kSteps;
            EXPECT_NEAR(mean, 1, 1e-6) << code;
        }
        EXPECT_NEAR(factors.at(kind, kSpreadCodes - 1, 0.3), 1, 1e-12); // no mean direction
    }
    for (const double cosine : {0.0, 0.3, 0.99}) {
        EXPECT_NEAR(factors.at(MaterialKind::fibre, 0, cosine),
                    std::sqrt(1 - cosine * cosine) * 4 / kPi, 1e-12);
        EXPECT_NEAR(factors.at(MaterialKind::surface, 0, cosine), 2 * cosine, 1e-12);
    }
}

} // namespace
} // namespace volcomp
