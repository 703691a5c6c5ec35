// SPDX-License-Identifier: Apache-2.0
// What one voxel holds where boxes meet: directions, spread, materials, colour.
#include <cmath>
#include <utility>

#include <gtest/gtest.h>

#include "tests/support/boxes.h"

namespace volcomp {
namespace {

using openvdb::Coord;

TEST(Compose, OppositeTangentsDoNotCancelAndCrossedOnesSpread)
{
    Box box{"one", 0, {}};
    box.volume.parts.push_back(fullPart(0.1));
    set(box.volume.parts[0], Coord(0, 0, 0), 5, {0, 1, 0}, Vec3f(1.0f));
    const auto directionOf = [&](const std::vector<Placement>& p) {
        const Volume v = composed({box}, p, voxel(0.1));
        return Vec3d(v.parts[0].direction->tree().getValue(Coord(0, 0, 0)));
    };
    const Placement up = turned({0, 0, 1}, 0, Vec3d(0.0)),
                    down = turned({0, 0, 1}, kPi, Vec3d(0.0));
    EXPECT_NEAR(std::abs(directionOf({up, down})[1]), 1, 1e-3);
    // Three crossed fibres have no direction; two of three keep the spread sqrt((1 + 0) / (2 * 2)).
    const Placement x = turned({0, 0, 1}, kPi / 2, Vec3d(0.0)),
                    z = turned({1, 0, 0}, kPi / 2, Vec3d(0.0));
    EXPECT_LT(directionOf({up, x, z}).length(), 0.01);
    EXPECT_NEAR(directionOf({up, up, x}).length(), 1 - 0.5, 1e-3);
    EXPECT_NEAR(std::abs(directionOf({up, up, x})[1]), 0.5, 1e-3);
}

TEST(Compose, OfTwoEquallyStrongDirectionsTheEarlierIsKept)
{
    Box box{"one", 0, {}};
    box.volume.parts.push_back(fullPart(0.1));
    set(box.volume.parts[0], Coord(0, 0, 0), 5, {0, 1, 0}, Vec3f(1.0f));
    const Vec3d axes[3] = {{0, 0, 1}, {1, 0, 0}, {1, 1, 1}};
    for (int first = 0; first < 3; ++first)
        for (int second = 0; second < 3; ++second) {
            // The fibre turned about an axis by 90 degrees and back again: at right angles, in both
            // orders.
            const Placement a = turned(axes[first], 0, Vec3d(0.0)),
                            b = turned(axes[second], kPi / 2, Vec3d(0.0));
            if (std::abs(a.y_axis.dot(b.y_axis)) > 0.1f) continue;
            for (const auto& [one, two] : {std::make_pair(a, b), std::make_pair(b, a)}) {
                std::vector<Placement> placements(
                    20, randomPlacement(1, 0.0)); // elsewhere, in the same tile
                for (Placement& p : placements) p.position = Vec3d(0.5, 0.5, 0.5);
                placements[7] = one;
                placements[8] = two;
                const Volume v = composed({box}, placements, voxel(0.1));
                const Vec3f d = v.parts[0].direction->tree().getValue(Coord(0, 0, 0));
                EXPECT_GT(std::abs(d.dot(one.y_axis)), 0.99f * d.length());
                EXPECT_NEAR(d.length(), 1 - std::sqrt(0.5), 1e-3);
            }
        }
}

TEST(Compose, ASpreadThatABoxHoldsIsKept)
{
    Box box{"one", 0, {}};
    box.volume.parts.push_back(fullPart(0.1));
    set(box.volume.parts[0], Coord(0, 0, 0), 5, Vec3f(0.0f, 0.7f, 0.0f), Vec3f(1.0f));
    const Volume v = composed(
        {box}, {turned({0, 0, 1}, kPi / 2, Vec3d(0.0)), turned({0, 0, 1}, kPi / 2, Vec3d(0.0))},
        voxel(0.1));
    EXPECT_NEAR(std::abs(v.parts[0].direction->tree().getValue(Coord(0, 0, 0))[0]), 0.7, 5e-4);
}

TEST(Compose, MaterialsKeepApartAndAVolumeOfOneHasOnePart)
{
    Box tree{"tree", 0, {}};
    tree.volume.parts.push_back(fullPart(0.1, "bark"));
    tree.volume.parts.push_back(fullPart(0.1, "leaf"));
    tree.volume.parts[1].kind = MaterialKind::surface;
    set(tree.volume.parts[0], Coord(0, 0, 0), 3, {0, 1, 0}, Vec3f(1.0f));
    set(tree.volume.parts[1], Coord(0, 0, 0), 5, {1, 0, 0}, Vec3f(1.0f));
    const Volume v = composed({tree}, {Placement{}}, voxel(0.1));
    ASSERT_EQ(v.parts.size(), 2u);
    EXPECT_EQ(v.parts[0].material, "bark");
    EXPECT_EQ(v.parts[1].kind, MaterialKind::surface);
    EXPECT_FLOAT_EQ(v.parts[0].density->tree().getValue(Coord(0, 0, 0)), 3);
    EXPECT_FLOAT_EQ(v.parts[1].density->tree().getValue(Coord(0, 0, 0)), 5);
    EXPECT_EQ(composed({strands(8, 8, 3, 0.1, 1)}, {Placement{}}, voxel(0.1)).parts.size(), 1u);
}

TEST(Compose, OneColourEverywhereIsNoGrid)
{
    Box box = strands(8, 8, 3, 0.1, 1);
    box.volume.parts[0].colour = nullptr;
    box.volume.parts[0].uniform_colour = Vec3f(0.5f, 0.25f, 0.125f);
    Placement p;
    p.tint = Vec3f(0.5f);
    const Volume v = composed({box}, {p, p}, voxel(0.1));
    EXPECT_EQ(v.parts[0].colour, nullptr);
    EXPECT_EQ(v.parts[0].uniform_colour, Vec3f(0.25f, 0.125f, 0.0625f));
    Placement other = p;
    other.tint = Vec3f(0.25f);
    EXPECT_NE(composed({box}, {p, other}, voxel(0.1)).parts[0].colour, nullptr);
}

TEST(Compose, VoxelsBelowTheMinimumAreNotKept)
{
    const Box box = strands(16, 20, 10, 0.01, 8);
    const Placement p = randomPlacement(3, 0.1);
    ComposeParams params = voxel(0.01);
    const std::size_t all = composed({box}, {p}, params).parts[0].density->activeVoxelCount();
    params.minimum_density = 5;
    const Volume v = composed({box}, {p}, params);
    EXPECT_LT(v.parts[0].density->activeVoxelCount(), all);
    for (auto it = v.parts[0].density->cbeginValueOn(); it; ++it) EXPECT_GT(*it, 5);
}

} // namespace
} // namespace volcomp
