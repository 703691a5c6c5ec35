// SPDX-License-Identifier: Apache-2.0
#include "volcomp/compose/tile_kernels.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/each_target.h"
#include "volcomp/base/principal_direction.h"
#include "volcomp/base/random.h"

namespace volcomp {
namespace {

constexpr int kEntries = sizeof(VoxelSum) / sizeof(float);

constexpr int kAcross = TileCells::kAcross, kMargin = TileCells::kMargin;

/// Memory for the cells of a tile.
struct Tile {
    std::vector<VoxelSum> sums = std::vector<VoxelSum>(TileCells::kCount + 1);
    std::vector<std::int32_t> touched = std::vector<std::int32_t>(kAcross * kAcross);

    TileCells cells() { return {sums.data(), touched.data()}; }
};

/// Random cubes that reach into a tile, with random sums.
CubeBatch randomCubes(int seed, float width)
{
    CubeBatch batch{};
    for (int k = 0; k < CubeBatch::kSize; ++k) {
        Random r(hashKey(seed, k));
        for (int i = 0; i < 3; ++i) batch.low[i][k] = float(r.uniform(-0.99 * width, 15.99));
        for (int c = 0; c < kEntries; ++c)
            if (c != 3 && c != 7) batch.sum[k].values[c] = float(r.uniform());
    }
    return batch;
}

TEST(TileKernels, EachCellGetsItsPartOfEachCube)
{
    // The overlaps in double; a float's rounding of a coordinate up to 18 is 1e-6.
    for (const float width : {0.25f, 1.0f, 1.4f, 2.0f}) {
        const CubeBatch batch = randomCubes(1, width);
        std::vector<double> expected(TileCells::kCount * kEntries);
        for (int k = 0; k < CubeBatch::kSize; ++k)
            for (int cell = 0; cell < TileCells::kCount; ++cell) {
                const int at[3] = {cell / (kAcross * kAcross), cell / kAcross % kAcross,
                                   cell % kAcross};
                double part = 1;
                for (int i = 0; i < 3; ++i) {
                    const double low = batch.low[i][k], first = at[i] - kMargin;
                    part *= std::max(0.0, std::min(low + width, first + 1) - std::max(low, first));
                }
                for (int c = 0; c < kEntries; ++c)
                    expected[cell * kEntries + c] += part * batch.sum[k].values[c];
            }
        onEachTarget([&] {
            Tile tile;
            addCubes(batch, CubeBatch::kSize, width, tile.cells());
            for (int cell = 0; cell < TileCells::kCount; ++cell)
                for (int c = 0; c < kEntries; ++c) {
                    const double e = expected[cell * kEntries + c];
                    ASSERT_NEAR(tile.sums[cell].values[c], e, 1e-5) << cell << " " << c;
                    if (c == VoxelSum::kDensity && e > 1e-5) {
                        ASSERT_TRUE(tile.touched[cell / kAcross] >> cell % kAcross & 1) << cell;
                    }
                }
        });
    }
}

TEST(TileKernels, OnlyTheFirstCubesOfABatchAreAdded)
{
    const CubeBatch batch = randomCubes(2, 1);
    for (int count = 0; count < 20; ++count)
        onEachTarget([&] {
            Tile tile;
            addCubes(batch, count, 1, tile.cells());
            double sum = 0, expected = 0;
            for (const VoxelSum& s : tile.sums) sum += s.density();
            for (int k = 0; k < count; ++k) expected += batch.sum[k].density();
            EXPECT_NEAR(sum, expected, 1e-5) << count;
        });
}

TEST(TileKernels, GatheringMovesTheListedCells)
{
    onEachTarget([&] {
        Tile tile;
        for (int cell = 0; cell <= TileCells::kCount; ++cell)
            for (int c = 0; c < kEntries; ++c)
                if (c != 7 && c != 15) tile.sums[cell].values[c] = float(cell * 16 + c);
        const auto channels = std::make_unique<TileChannels>();
        const int count = 37;
        for (int k = 0; k < count; ++k) channels->cell[k] = 101 * k + 5;
        gatherCells(count, tile.cells(), true, *channels);
        for (int k = 0; k < 48; ++k) {
            const int cell = k < count ? 101 * k + 5 : TileCells::kCount;
            for (int i = 0; i < 3; ++i) {
                EXPECT_EQ(channels->tensor[i][k], float(cell * 16 + i));
                EXPECT_EQ(channels->tensor[3 + i][k], float(cell * 16 + 4 + i));
                EXPECT_EQ(channels->colour[i][k], float(cell * 16 + 8 + i));
                EXPECT_EQ(channels->scatter_ratio[i][k], float(cell * 16 + 12 + i));
            }
            EXPECT_EQ(channels->squares[k], float(cell * 16 + 3));
            EXPECT_EQ(channels->density[k], float(cell * 16 + 11));
        }
        for (int k = 0; k < count; ++k)
            for (const float v : tile.sums[101 * k + 5].values) EXPECT_EQ(v, 0);
        EXPECT_EQ(tile.sums[6].density(), float(6 * 16 + 11));
        EXPECT_EQ(tile.sums[TileCells::kCount].density(), float(TileCells::kCount * 16 + 11));
    });
}

/// Fills the channels with the sums of a few directions each, from alike to crossed.
void fillTensors(int count, TileChannels& c)
{
    for (int k = 0; k < count; ++k) {
        Random r(hashKey(3, k));
        SymmetricTensor t;
        const Vec3d first = Vec3d(r.normal(), r.normal(), r.normal()).unit();
        const double apart = std::pow(10, r.uniform(-3, 1)),
                     weight = std::pow(10, r.uniform(-3, 3));
        for (int i = 0; i < 3; ++i)
            t.add(weight * r.uniform(),
                  (first + Vec3d(r.normal(), r.normal(), r.normal()) * apart).unit());
        if (k % 100 == 0) // no direction is the largest; three random ones hardly ever are so even
            for (int i = 0; i < 3; ++i) {
                Vec3d axis(0.0);
                axis[i] = 1;
                t.add(1e3 * weight * (1 + 0.003 * r.uniform()), axis);
            }
        const double values[6] = {t.xx, t.yy, t.zz, t.xy, t.yz, t.xz};
        for (int i = 0; i < 6; ++i) c.tensor[i][k] = float(values[i]);
    }
}

TEST(TileKernels, DirectionsAreTheLargestEigenvectors)
{
    constexpr int kCount = 4000; // a multiple of 16: there is no padding
    onEachTarget([&] {
        const auto c = std::make_unique<TileChannels>();
        fillTensors(kCount, *c);
        const int unsure = findDirections(kCount, *c);
        std::vector<bool> is_unsure(kCount);
        for (int i = 0; i < unsure; ++i) is_unsure.at(c->unsure[i]) = true;
        int sure = 0;
        for (int k = 0; k < kCount; ++k) {
            const auto& t = c->tensor;
            const SymmetricTensor s{t[0][k], t[1][k], t[2][k], t[3][k], t[5][k], t[4][k]};
            double values[3];
            Vec3d vectors[3];
            jacobiEigen(s, values, vectors);
            const double largest = values[0] / s.trace(), second = values[1] / s.trace();
            // Unsure only if two eigenvalues are close, and always if they are very close.
            if (is_unsure[k]) {
                EXPECT_LT(largest - second, 0.03);
                continue;
            }
            EXPECT_GT(largest - second, 0.004);
            ++sure;
            const Vec3d expected = principalDirection(s).stored();
            const Vec3d d(c->direction[0][k], c->direction[1][k], c->direction[2][k]);
            // A float's rounding of the tensor turns the vector by up to it / (l1 - l2). The square
            // root makes 1 - length of nearly equal directions the least exact: 3e-4 at 1e-7.
            EXPECT_LT(std::min((d - expected).length(), (d + expected).length()),
                      5e-4 + 2e-6 / (largest - second))
                << k;
        }
        EXPECT_GT(sure, kCount / 2);
        EXPECT_GE(unsure, kCount / 100);
    });
}

TEST(TileKernels, TheBytesAreTheSameWithEveryInstructionSet)
{
    std::vector<char> first;
    onEachTarget([&] {
        Tile tile;
        for (const float width : {0.25f, 1.0f, 1.4f, 2.0f})
            for (int seed = 0; seed < 20; ++seed)
                addCubes(randomCubes(seed, width), CubeBatch::kSize, width, tile.cells());
        const auto c = std::make_unique<TileChannels>();
        std::memset(c.get(), 0, sizeof(*c));
        int count = 0;
        for (int cell = 0; cell < TileCells::kCount && count < TileChannels::kMost; ++cell)
            if (tile.sums[cell].density() > 0) c->cell[count++] = cell;
        tile.sums[TileCells::kCount].values[VoxelSum::kDiagonal] = 1;
        tile.sums[TileCells::kCount].values[VoxelSum::kDensity] = 1;
        gatherCells(count, tile.cells(), true, *c);
        findDirections(count, *c);
        divideByDensity(count, *c, c->colour);
        divideByDensity(count, *c, c->scatter_ratio);
        std::vector<char> bytes(reinterpret_cast<const char*>(tile.touched.data()),
                                reinterpret_cast<const char*>(tile.touched.data())
                                    + tile.touched.size() * sizeof(std::int32_t));
        const auto put = [&](const float* values) {
            const char* const from = reinterpret_cast<const char*>(values);
            bytes.insert(bytes.end(), from, from + std::size_t(count) * sizeof(float));
        };
        put(c->density);
        put(c->squares);
        for (const auto& row : c->scatter_ratio) put(row);
        for (const auto& row : c->tensor) put(row);
        for (const auto& row : c->colour) put(row);
        for (const auto& row : c->direction) put(row);
        EXPECT_GT(count, 4000);
        if (first.empty()) first = bytes;
        EXPECT_TRUE(bytes == first);
    });
}

} // namespace
} // namespace volcomp
