// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/sky/openness.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "volcomp/base/parallel.h"
#include "volcomp/base/random.h"
#include "volcomp/render/sky/neighbour_directions.h"
#include "tests/support/skins.h"
#include "tests/support/volumes.h"

using namespace volcomp;

namespace {

Vec3d onSphere(Random& random)
{
    const double z = 2 * random.uniform() - 1, turn = 2 * kPi * random.uniform(),
                 s = std::sqrt(1 - z * z);
    return {s * std::cos(turn), s * std::sin(turn), z};
}

/// A box of even density from voxel (0,0,0) on.
VoxelTree evenBox(const openvdb::Coord& size, double density, double voxel = 1)
{
    Volume volume = emptyVolume(voxel);
    volume.parts[0].density->fill(openvdb::CoordBBox({0, 0, 0}, size.offsetBy(-1)), float(density));
    return VoxelTree(volume);
}

/// The exponential integral E2.
double e2(double tau)
{
    double sum = 0;
    constexpr int kSteps = 20000;
    for (int i = 0; i < kSteps; ++i) sum += std::exp(-tau * kSteps / (i + 0.5)) / kSteps;
    return sum;
}

} // namespace

TEST(Openness, WeightsAreTheSharesOfTheSphere)
{
    double sum = 0;
    for (const double w : Openness::weights()) sum += w;
    EXPECT_NEAR(sum, 1, 1e-12);
    const Openness openness(evenBox({8, 8, 8}, 1), 1);
    std::array<double, 26> counts{};
    Random random(3);
    constexpr int kPlaces = 200000;
    for (int i = 0; i < kPlaces; ++i) {
        const Vec3d d = onSphere(random);
        int best = 0;
        for (int n = 1; n < 26; ++n)
            if (openness.directions()[n].dot(d) > openness.directions()[best].dot(d)) best = n;
        ASSERT_EQ(openness.nearest(d), best);
        counts[best] += 1.0 / kPlaces;
    }
    for (int n = 0; n < 26; ++n) EXPECT_NEAR(counts[n], Openness::weights()[n], 0.002) << n;
}

// Each direction against a sum in double precision along the line of cells.
TEST(Openness, DirectionsAreTheSumsAlongTheLinesOfCells)
{
    NoiseParams params;
    params.size = 41;
    params.origin = {-19, 5, -3};
    params.most = 0.1;
    const VoxelTree tree(noise(params));
    constexpr double kExtinction = 0.7;
    const Openness openness(tree, kExtinction);
    EXPECT_EQ(openness.cellSize(), 8);
    // Of a cell's width: for what passes through as much as its columns let through, mean over the
    // axes; for what begins in it its mean density.
    struct Depth {
        double through = 0, own = 0;
    };
    const auto cellDepth = [&](int x, int y, int z) {
        Depth depth;
        for (int axis = 0; axis < 3; ++axis) {
            double passes = 0;
            for (int column = 0; column < 64; ++column) {
                double sum = 0;
                for (int i = 0; i < 8; ++i) {
                    int at[3] = {8 * x, 8 * y, 8 * z};
                    at[axis] += i;
                    at[(axis + 1) % 3] += column / 8;
                    at[(axis + 2) % 3] += column % 8;
                    sum += tree.density(at[0], at[1], at[2]);
                }
                passes += std::exp(-kExtinction * sum) / 64;
                depth.own += kExtinction * sum / (3 * 64);
            }
            depth.through -= std::log(passes) / 3;
        }
        return depth;
    };
    for (int x = -4; x <= 3; ++x)
        for (int y = -1; y <= 6; ++y)
            for (int z = -2; z <= 5; ++z) {
                const Vec3d p = Vec3d(x + 0.5, y + 0.5, z + 0.5) * 8.0 + tree.origin();
                const Openness::ByDirection found = openness.open(p);
                double closed = 1;
                for (int d = 0; d < 26; ++d) {
                    const NeighbourStep step = neighbourStep(d);
                    const double widths = std::sqrt(double(neighbourAxes(step)));
                    double depth = 0.5 * widths * cellDepth(x, y, z).own;
                    for (int i = 1; i < 12; ++i)
                        depth += widths
                            * cellDepth(x + i * step[0], y + i * step[1], z + i * step[2]).through;
                    ASSERT_NEAR(found[d], std::exp(-depth), 0.5 / 255 + 1e-5)
                        << x << ' ' << y << ' ' << z << ' ' << d;
                    closed -= Openness::weights()[d] * std::exp(-depth);
                    const Vec3d towards(step[0], step[1], step[2]);
                    ASSERT_NEAR(openness.directions()[d].dot(towards.unit()), 1, 1e-12);
                }
                ASSERT_NEAR(openness.closed(p), closed, 1e-4);
            }
}

// Clumps let more through than the same particles spread evenly: dense cubes of 2 voxels with gaps
// of 6 between them, in which rays along axes, edges and corners meet few.
TEST(Openness, ClumpsAreOpenerThanTheSameParticlesSpreadEvenly)
{
    Volume clumps = emptyVolume();
    Random random(11);
    constexpr int kSize = 96;
    double mass = 0;
    for (int x = 0; x < kSize; x += 8)
        for (int y = 0; y < kSize; y += 8)
            for (int z = 0; z < kSize; z += 8) {
                const auto at = [&](int low) { return low + int(random.uniform() * 7); };
                const openvdb::Coord low(at(x), at(y), at(z));
                clumps.parts[0].density->fill(openvdb::CoordBBox(low, low.offsetBy(1)), 4.0F);
                mass += 8 * 4;
            }
    const double even = mass / (double(kSize) * kSize * kSize);
    const VoxelTree tree(clumps);
    const Openness openness(tree, 1), spread(evenBox({kSize, kSize, kSize}, even), 1);
    // What rays from a place at random between the clumps get through, voxel by voxel.
    double passes = 0, found = 0, mean = 0;
    constexpr int kRays = 20000;
    for (int i = 0; i < kRays; ++i) {
        const Vec3d p(kSize * (0.25 + 0.5 * random.uniform()),
                      kSize * (0.25 + 0.5 * random.uniform()),
                      kSize * (0.25 + 0.5 * random.uniform()));
        const double z = 2 * random.uniform() - 1, turn = 2 * kPi * random.uniform(),
                     s = std::sqrt(1 - z * z);
        const Vec3d d(s * std::cos(turn), s * std::sin(turn), z);
        double depth = 0;
        for (double t = 0.05; t < 2 * kSize; t += 0.1) {
            const Vec3d q = p + t * d;
            depth += 0.1
                * tree.density(int(std::floor(q[0])), int(std::floor(q[1])), int(std::floor(q[2])));
        }
        passes += std::exp(-depth) / kRays;
        found += (1 - openness.closed(tree.origin() + p)) / kRays;
        mean += (1 - spread.closed(tree.origin() + p)) / kRays;
    }
    EXPECT_NEAR(found / passes, 1, 0.15);
    EXPECT_LT(mean, 0.6 * passes);
}

TEST(Openness, SlabIsHalfOpenAtItsFaceAndClosedInside)
{
    const double density = 0.05; // 0.4 a cell
    const VoxelTree tree = evenBox({240, 160, 240}, density);
    const Openness openness(tree, 1);
    const auto at = [&](double depth) {
        return openness.closed(tree.origin() + Vec3d(120, 160 - depth, 120));
    };
    // The eight directions along the face count as blocked: this is what 26 directions give.
    EXPECT_NEAR(at(0), 0.5, 0.05);
    for (const double depth : {4.0, 8.0, 20.0, 40.0})
        EXPECT_NEAR(at(depth), 1 - e2(density * depth) / 2, 0.05) << depth;
    EXPECT_GT(at(80), 0.993); // 1 - e2(4) / 2 is 0.9984
    const Openness dense(evenBox({64, 64, 64}, 2), 1);
    EXPECT_NEAR(dense.closed(tree.origin() + Vec3d(32, 32, 32)), 1, 1e-4);
}

TEST(Openness, FarOutsideEverythingIsOpen)
{
    const VoxelTree tree = evenBox({16, 16, 16}, 1);
    const Openness openness(tree, 1);
    const Vec3d middle = tree.origin() + Vec3d(8, 8, 8);
    Openness::ByDirection far = openness.openWithoutSkins(middle + Vec3d(500, 300, 100));
    for (int d = 0; d < 26; ++d) EXPECT_EQ(far[d], 1) << d;
    // A place beside it sees the volume in one direction.
    const Openness::ByDirection beside = openness.openWithoutSkins(middle + Vec3d(100, 0, 0));
    const NeighbourStep back{-1, 0, 0};
    for (int d = 0; d < 26; ++d)
        EXPECT_NEAR(beside[d], neighbourStep(d) == back ? 0 : 1, 1e-4) << d;
    EXPECT_EQ(Openness(VoxelTree(emptyVolume()), 1).closed(middle), 0);
}

TEST(Openness, LevelsOfDetailAndRotationShareItByWorldPosition)
{
    Volume volume = emptyVolume(0.5);
    volume.parts[0].density->fill(openvdb::CoordBBox({0, 0, 0}, {31, 31, 31}), 1.0F);
    const auto turned = openvdb::math::Transform::createLinearTransform(0.5);
    turned->postRotate(0.7, openvdb::math::Y_AXIS);
    turned->postTranslate({3, 1, 2});
    volume.parts[0].density->setTransform(turned);
    const VoxelTree tree(volume);
    const Openness openness(tree, 0.1);
    const Vec3d up = tree.directionToWorld({0, 1, 0}), middle(16, 16, 16);
    const Vec3d p = tree.origin() + 0.5 * tree.directionToWorld(middle);
    const int d = openness.nearest(up);
    EXPECT_NEAR(openness.directions()[d].dot(up), 1, 1e-12);
    EXPECT_NEAR(openness.open(p)[d], std::exp(-1.6), 0.02);
}

TEST(Openness, WiderCellsGiveNearlyTheSame)
{
    const VoxelTree tree = evenBox({128, 128, 128}, 0.02);
    const Openness fine(tree, 1), coarse(tree, 1, nullptr, true, 3000);
    EXPECT_EQ(coarse.cellSize(), 16);
    double sum = 0, difference = 0;
    Random random(2);
    for (int i = 0; i < 2000; ++i) {
        const Vec3d p =
            tree.origin() + 128.0 * Vec3d(random.uniform(), random.uniform(), random.uniform());
        sum += fine.closed(p);
        difference += std::abs(fine.closed(p) - coarse.closed(p));
    }
    EXPECT_LT(difference / sum, 0.03);
}

TEST(Openness, DoesNotDependOnThreads)
{
    NoiseParams params;
    params.size = 70;
    const VoxelTree tree(noise(params));
    const auto all = [&](int threads) {
        const ThreadLimit limit(threads);
        const Openness openness(tree, 0.1);
        std::vector<double> values;
        for (int i = 0; i < 1000; ++i)
            values.push_back(
                openness.closed(tree.origin() + Vec3d(i % 70, i * 7 % 71, i * 3 % 69)));
        return values;
    };
    EXPECT_EQ(all(1), all(4));
}

TEST(Openness, SkinsBlock)
{
    // A thin layer of density above a wall, and cells of nothing below it.
    const VoxelTree tree = evenBox({64, 8, 64}, 0.001);
    const Vec3d corner = tree.origin();
    const auto skins =
        tracerOf(skinMesh(squareMesh(corner + Vec3d(32, 0, 32), Vec3d(0, 1, 0), 1000)));
    const Openness with(tree, 1, skins.get()), without(tree, 1);
    const Vec3d p = corner + Vec3d(32, 2, 32); // between a cell of density and one below the wall
    const Openness::ByDirection open = with.open(p), volume = with.openWithoutSkins(p),
                                same = without.open(p);
    double up = 0;
    for (int d = 0; d < 26; ++d) {
        EXPECT_EQ(volume[d], same[d]);
        const double y = with.directions()[d][1];
        if (y < -0.1) EXPECT_EQ(open[d], 0);
        else EXPECT_EQ(open[d], same[d]);
        if (y > 0.1) up += Openness::weights()[d];
    }
    // Rays along the wall go by it.
    EXPECT_NEAR(with.closed(p), up + without.closed(p) * (1 - up), 0.01);
}
