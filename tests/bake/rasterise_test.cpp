// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "tests/support/message_of.h"
#include "volcomp/base/error.h"
#include "volcomp/base/random.h"
#include "volcomp/bake/rasterise.h"

using namespace volcomp;

namespace {

Segment cone(const Vec3d& a, const Vec3d& b, double radius_a, double radius_b,
             std::uint32_t strand = 0)
{
    Segment s;
    s.a = Vec3f(a);
    s.b = Vec3f(b);
    s.size_a = static_cast<float>(radius_a);
    s.size_b = static_cast<float>(radius_b);
    s.strand = strand;
    return s;
}

/// Sum of 1 - exp(-rho h): the coverage where one strand is in each voxel.
double totalCoverage(const VolumePart& part)
{
    const double h = part.density->voxelSize()[0];
    double sum = 0;
    for (auto it = part.density->cbeginValueOn(); it; ++it) sum -= std::expm1(-*it * h);
    return sum;
}

VolumePart bakeFibre(const std::vector<Segment>& segments, double voxel)
{
    return rasterise(segments, "m", MaterialKind::fibre, voxel);
}

} // namespace

// (pi/4) 2 r l / h^2, and 0.3 r / h of it more for voxels that stand behind each other.
TEST(Rasterise, CoverageOfAThinStrandIsExact)
{
    Random random(1);
    for (int i = 0; i < 200; ++i) {
        const double h = std::pow(10, 2 * random.symmetric()), r0 = 0.1 * h * random.uniform(),
                     r1 = r0 * random.uniform();
        const auto point = [&] {
            return Vec3d(random.symmetric(), random.symmetric(), random.symmetric()) * 30 * h;
        };
        const Vec3d a = point(), b = i % 4 == 0 ? a + Vec3d(0, 20 * h, 0) : point();
        const VolumePart part = bakeFibre({cone(a, b, r0, r1)}, h);
        const double expected =
            kPi / 4 * (r0 + r1) * (b - a).length() / (h * h) * (1 + 0.15 * (r0 + r1) / h);
        EXPECT_NEAR(totalCoverage(part), expected, 1e-4 * expected + 2e-3)
            << i; // voxels below 1e-5 are not kept
    }
}

TEST(Rasterise, NumberOfPiecesDoesNotMatter)
{
    const Vec3d a(0.13, 0.1, 0.2), b(2.1, 3.7, 1.9);
    const auto pieces = [&](int n) {
        std::vector<Segment> segments;
        for (int k = 0; k < n; ++k)
            segments.push_back(cone(a + (b - a) * k / n, a + (b - a) * (k + 1) / n, 0.05, 0.05));
        return bakeFibre(segments, 0.25);
    };
    const VolumePart one = pieces(1), many = pieces(57);
    for (auto it = one.density->cbeginValueOn(); it; ++it)
        EXPECT_NEAR(many.density->tree().getValue(it.getCoord()), *it, 1e-4 * *it + 1e-3);
}

TEST(Rasterise, ThickStrandIsFullInsideWithoutDoubleCountAtJoints)
{
    const double h = 0.1;
    const VolumePart part =
        bakeFibre({cone({0, 0, 0}, {0, 1, 0}, 0.5, 0.5), cone({0, 1, 0}, {0, 2, 0}, 0.5, 0.5)}, h);
    const float full = static_cast<float>(-std::log(0.01) / h);
    for (int y = 1; y < 20; ++y)
        EXPECT_NEAR(part.density->tree().getValue(openvdb::Coord(3, y, 1)), full, 1e-3 * full) << y;
    const VolumePart whole = bakeFibre({cone({0, 0, 0}, {0, 2, 0}, 0.5, 0.5)}, h);
    EXPECT_EQ(part.density->activeVoxelCount(), whole.density->activeVoxelCount());
    for (auto it = whole.density->cbeginValueOn(); it; ++it)
        EXPECT_NEAR(part.density->tree().getValue(it.getCoord()), *it, 1e-3 * full);
}

TEST(Rasterise, ThinAndThickFormulaMeet)
{
    const auto coverage = [](double radius) {
        return totalCoverage(bakeFibre({cone({0.2, 0, 0.1}, {30.2, 40, 30.1}, radius, radius)}, 1));
    };
    const double below = coverage(0.577), above = coverage(0.578); // the switch is at sqrt(1/3)
    EXPECT_NEAR(above, below, 0.06 * below);
    EXPECT_NEAR(coverage(0.126), kPi / 2 * 0.126 * 1.038 * std::sqrt(30.0 * 30 + 40 * 40 + 30 * 30),
                0.02 * coverage(0.126))
        << "spread over the cross-section from 1/8 on";
    double last = 0;
    for (double r = 0.02; r < 1.5; r += 0.02) {
        EXPECT_GT(coverage(r), 0.98 * last) << r;
        last = coverage(r);
    }
}

TEST(Rasterise, DirectionIsTheTangentOrTheNormal)
{
    const Vec3d t = Vec3d(1, 2, -1) / std::sqrt(6.0);
    const VolumePart fibre = bakeFibre({cone({0, 0, 0}, t * 20, 0.05, 0.05)}, 1);
    for (auto it = fibre.direction->cbeginValueOn(); it; ++it)
        EXPECT_NEAR(std::abs(Vec3d(*it).dot(t)), 1, 1e-3);
    const VolumePart trunk =
        rasterise({cone({0, 0, 0}, {0, 20, 0}, 5, 5)}, "m", MaterialKind::surface, 1);
    for (auto it = trunk.direction->cbeginValueOn(); it; ++it) {
        const openvdb::Coord c = it.getCoord();
        if (c[1] < 2 || c[1] > 18 || (c[0] == 0 && c[2] == 0)) continue;
        EXPECT_NEAR(std::abs(Vec3d(*it).dot(Vec3d(c[0], 0, c[2]))), std::hypot(c[0], c[2]), 1e-3);
    }
    Segment leaf = cone({0, 0, 0}, {4, 0, 0}, 1, 1);
    leaf.side = Vec3f(0, 0.6f, 0.8f);
    const VolumePart leaves = rasterise({leaf}, "m", MaterialKind::surface, 0.3);
    for (auto it = leaves.direction->cbeginValueOn(); it; ++it)
        EXPECT_NEAR(std::abs(Vec3d(*it).dot(Vec3d(0, -0.8, 0.6))), 1, 1e-3);
}

TEST(Rasterise, SameBytesForAnyNumberOfThreads)
{
    Random random(5);
    std::vector<Segment> segments;
    for (std::uint32_t i = 0; i < 3000; ++i) {
        const Vec3d a(10 * random.uniform(), 10 * random.uniform(), 10 * random.uniform());
        segments.push_back(
            cone(a, a + Vec3d(random.symmetric(), random.symmetric(), random.symmetric()),
                 0.3 * random.uniform(), 0.05, i / 3));
    }
    const auto with = [&](std::size_t threads) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        return bakeFibre(segments, 0.2);
    };
    const VolumePart one = with(1), four = with(4);
    EXPECT_EQ(one.density->activeVoxelCount(), four.density->activeVoxelCount());
    for (auto it = one.density->cbeginValueOn(); it; ++it) {
        ASSERT_EQ(four.density->tree().getValue(it.getCoord()), *it);
        ASSERT_EQ(four.direction->tree().getValue(it.getCoord()),
                  one.direction->tree().getValue(it.getCoord()));
    }
}

TEST(Rasterise, RefusesWhatIsNotFinite)
{
    EXPECT_THROW(bakeFibre({cone({0, 0, 0}, {0, std::nan(""), 0}, 1, 1)}, 1), Error);
    EXPECT_THROW(bakeFibre({cone({0, 0, 0}, {0, 1, 0}, -1, 1)}, 1), Error);
    EXPECT_THROW(bakeFibre({cone({0, 0, 0}, {0, 1e8, 0}, 1, 1)}, 1), Error);
    EXPECT_THROW(bakeFibre({}, 0), Error);
    EXPECT_EQ(bakeFibre({}, 1).density->activeVoxelCount(), 0U);
}

// The cuboid around this strand has 2e11 blocks of voxels, the strand some ten thousand.
TEST(Rasterise, ALongStrandCostsWhatItTouches)
{
    const double h = 2e-5, r = 1e-6;
    const Vec3d a(-0.3, -0.31, 0.02), b(0.31, 0.29, 0.7);
    const double expected = kPi / 4 * 2 * r * (b - a).length() / (h * h) * (1 + 0.3 * r / h);
    EXPECT_NEAR(totalCoverage(bakeFibre({cone(a, b, r, r)}, h)) / expected, 1, 1e-3);
}

TEST(Rasterise, WhatWouldFillTooManyVoxelsIsRefusedAtOnce)
{
    const auto message = [](double radius, double voxel) {
        return messageOf(
            [&] { bakeFibre({cone(Vec3d(0, 0, 0), Vec3d(0, 1, 0), radius, radius)}, voxel); });
    };
    EXPECT_NE(message(5, 1.5e-5).find("a larger voxel or thinner or fewer strands"),
              std::string::npos)
        << message(5, 1.5e-5);
}

// The normals of a thick strand point outwards. In the voxels of its axis they have no direction
// more than another across it, whatever voxel came before.
TEST(Rasterise, OnTheAxisOfAThickStrandNormalsPointAllAround)
{
    const double h = 0.1;
    for (int axis = 0; axis < 3; ++axis) {
        Vec3d end(0.0);
        end[axis] = 20 * h;
        const VolumePart part =
            rasterise({cone(Vec3d(0.0), end, 3 * h, 3 * h)}, "m", MaterialKind::surface, h);
        for (int k = 2; k < 18; ++k) {
            openvdb::Coord c(0, 0, 0);
            c[axis] = k;
            const Vec3f inside = part.direction->tree().getValue(c);
            EXPECT_GT(part.density->tree().getValue(c), 0);
            EXPECT_NEAR(inside[axis], 0, 1e-5) << axis << " " << k;
            // Two equal eigenvalues of three: a spread of sqrt(1/2).
            EXPECT_NEAR(inside.length(), 1 - std::sqrt(0.5), 1e-5) << axis << " " << k;
            for (const int side : {-2, 2}) {
                openvdb::Coord beside = c;
                beside[(axis + 1) % 3] = side;
                const Vec3f normal = part.direction->tree().getValue(beside);
                EXPECT_NEAR(std::abs(normal[(axis + 1) % 3]), 1, 1e-4) << axis << " " << k;
            }
        }
    }
}
