// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/shadow/ray_bundle.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include <gtest/gtest.h>

#include "volcomp/base/random.h"
#include "tests/support/each_target.h"

using namespace volcomp;

namespace {

constexpr int kSide = RayBundle::kSide, kSlices = 8, kWidth = 24; ///< of the strip, voxels

/// A strip of random densities, a third of them 0, with what the rays may read around it.
struct RandomStrip {
    std::vector<float> values;
    Strip strip;

    explicit RandomStrip(bool up) : values(Strip::kSize + 2 * Strip::kMargin)
    {
        Random random(11);
        float* densities = values.data() + Strip::kMargin;
        for (int i = 0; i < kSlices * kWidth * kWidth; ++i)
            densities[i] = float(std::max(0.0, random.uniform(-0.5, 1)));
        const int slice = kWidth * kWidth;
        strip.row_stride = kWidth;
        strip.slice_stride = up ? slice : -slice;
        strip.first_slice = densities + (up ? 0 : kSlices - 1) * slice;
    }
    double density(int slice, int b, int c) const
    {
        return strip.first_slice[slice * strip.slice_stride + b * kWidth + c];
    }
};

/// Density x travel along one ray: the sum over the pieces between all borders that it crosses.
double bruteForceSum(const RandomStrip& strip, double b, double b_slope, double c, double c_slope,
                     double travel)
{
    const double start = kSlices - travel; // in the first slice
    std::vector<double> borders{0, travel};
    for (int n = 0; n <= kWidth; ++n) {
        if (n <= kSlices) borders.push_back(n - start);
        if (b_slope != 0) borders.push_back((n - b) / b_slope);
        if (c_slope != 0) borders.push_back((n - c) / c_slope);
    }
    std::sort(borders.begin(), borders.end());
    double sum = 0;
    for (std::size_t i = 1; i < borders.size(); ++i) {
        const double t0 = std::max(0.0, borders[i - 1]), t1 = std::min(travel, borders[i]);
        if (!(t1 > t0)) continue;
        const double t = 0.5 * (t0 + t1);
        sum += (t1 - t0)
            * strip.density(int(std::floor(start + t)), int(std::floor(b + b_slope * t)),
                            int(std::floor(c + c_slope * t)));
    }
    return sum;
}

/// Parallel rays 2/3 voxel apart, or a fan's whose slopes change from ray to ray.
RayBundle raysOf(Random& random, bool fans)
{
    RayBundle rays;
    const double spacing = fans ? 0.5 : 2.0 / 3; // a fan's grows on the way
    const double slope[2] = {random.uniform(-0.95, 0.8), random.uniform(-0.95, 0.8)};
    const double at[2] = {random.uniform(0, 1), random.uniform(0, 1)};
    const auto start = [&](int axis) { return at[axis] + (slope[axis] < 0 ? 9 : 3); };
    for (int i = 0; i < kSide; ++i) {
        rays.b_slope[i] = slope[0] + (fans ? 0.01 * i : 0);
        rays.c_slope[i] = slope[1] + (fans ? 0.01 * i : 0);
        rays.b[i] = start(0) + spacing * i;
        rays.c[i] = start(1) + spacing * i;
    }
    return rays;
}

} // namespace

// On every instruction set each ray's sum is that of all pieces between the borders on its way. A
// sum has 24 terms of 8 at most in all; each addition rounds by 2^-24 of it.
TEST(RayBundle, SumsAreThoseOfExactRays)
{
    constexpr double kRounding = 24 * 8 * 0x1p-24;
    Random random(3);
    for (int n = 0; n < 20; ++n) {
        const RandomStrip strip(n % 2);
        const bool fans = n % 4 > 1;
        RayBundle start = raysOf(random, fans);
        if (n == 8) std::fill(start.b_slope, start.b_slope + kSide, 0.0); // along the axis
        if (n == 9) std::fill(start.c_slope, start.c_slope + kSide, -1e-15);
        const double first_way = fans ? 0.3 : 1, travel = kSlices - 1 + first_way;
        RaySums first;
        bool has_first = false;
        onEachTarget([&] {
            RayBundle rays = start;
            RaySums sums;
            const float least = pushRays(strip.strip, kSlices, first_way, rays, sums);
            EXPECT_EQ(least, *std::min_element(sums.values, sums.values + RayBundle::kRays));
            for (int i = 0; i < kSide; ++i)
                for (int j = 0; j < kSide; ++j)
                    ASSERT_NEAR(sums.values[i * kSide + j],
                                bruteForceSum(strip, start.b[i], start.b_slope[i], start.c[j],
                                              start.c_slope[j], travel),
                                kRounding)
                        << n << " ray " << i << " " << j;
            EXPECT_NEAR(rays.c[3], start.c[3] + travel * start.c_slope[3], 1e-12);
            if (has_first) {
                EXPECT_EQ(std::memcmp(&sums, &first, sizeof sums), 0) << n;
            }
            first = sums;
            has_first = true;
        });
    }
}

// A code is 255 roots of the transmittance, off by half a unit of rounding and a tenth of the
// exponential, and the same byte on every instruction set.
TEST(RayBundle, CodesAreRootsOfTheTransmittance)
{
    Random random(4);
    for (int n = 0; n < 20; ++n) {
        const RayBundle rays = raysOf(random, true);
        RaySums sums;
        for (float& sum : sums.values) sum = float(std::pow(10, random.uniform(-4, 3)));
        sums.values[0] = 0;
        const double extinction = 0.3;
        for (const int stride : {1, 3}) {
            const int side = (kSide - 1) / stride + 1;
            std::vector<std::uint8_t> first;
            onEachTarget([&] {
                std::vector<std::uint8_t> codes(side * side);
                encodeTransmittances(rays, sums, extinction, stride, codes.data());
                for (int i = 0; i < side; ++i)
                    for (int j = 0; j < side; ++j) {
                        const double length = std::sqrt(1 + std::pow(rays.b_slope[i * stride], 2)
                                                        + std::pow(rays.c_slope[j * stride], 2)),
                                     depth = extinction * length
                            * sums.values[i * stride * kSide + j * stride];
                        ASSERT_NEAR(codes[i * side + j], 255 * std::exp(-0.5 * depth), 0.6);
                    }
                if (!first.empty()) {
                    EXPECT_EQ(codes, first);
                }
                first = codes;
            });
        }
    }
}
