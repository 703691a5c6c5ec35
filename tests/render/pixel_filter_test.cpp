// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/pixel_filter.h"

#include <cmath>

#include <gtest/gtest.h>

#include "volcomp/render/render.h"
#include "tests/support/volumes.h"

using namespace volcomp;

namespace {

RenderParams withFilter(PixelFilter filter, int samples, double radius = 0)
{
    RenderParams params;
    params.width = 8;
    params.height = 8;
    params.cutoff = 0;
    params.samples = samples;
    params.pixel_filter = filter;
    params.pixel_radius = radius;
    return params;
}

constexpr PixelFilter kFilters[] = {PixelFilter::box, PixelFilter::gaussian,
                                    PixelFilter::blackman_harris};

// The part of the filter's weight that lies below x pixels from the centre, by a sum.
double weightBelow(PixelFilter filter, double radius, double x)
{
    constexpr int kSteps = 20000;
    double below = 0, all = 0;
    for (int i = 0; i < kSteps; ++i) {
        const double at = 2 * (i + 0.5) / kSteps - 1, w = pixelWeight(filter, at);
        all += w;
        if (at * radius < x) below += w;
    }
    return below / all;
}

} // namespace

// Harris's window follows from its coefficients where the cosines are 0, 1 or -1. The Gaussian's
// radius is three standard deviations.
TEST(PixelFilter, WeightsAreTheFormulas)
{
    EXPECT_EQ(pixelWeight(PixelFilter::box, 0.99), 1);
    EXPECT_NEAR(pixelWeight(PixelFilter::gaussian, 1.0 / 3) / pixelWeight(PixelFilter::gaussian, 0),
                std::exp(-0.5), 1e-12);
    EXPECT_NEAR(pixelWeight(PixelFilter::gaussian, -2.0 / 3)
                    / pixelWeight(PixelFilter::gaussian, 0),
                std::exp(-2.0), 1e-12);
    EXPECT_NEAR(pixelWeight(PixelFilter::blackman_harris, 0), 1, 1e-12);
    EXPECT_NEAR(pixelWeight(PixelFilter::blackman_harris, 0.5), 0.35875 - 0.14128, 1e-12);
    EXPECT_NEAR(pixelWeight(PixelFilter::blackman_harris, -1),
                0.35875 - 0.48829 + 0.14128 - 0.01168, 1e-12);
    for (const PixelFilter filter : kFilters)
        for (const double x : {-1.001, 1.001, 4.0}) EXPECT_EQ(pixelWeight(filter, x), 0);
    EXPECT_EQ(pixelRadius(withFilter(PixelFilter::box, 1)), 0.5);
    EXPECT_EQ(pixelRadius(withFilter(PixelFilter::gaussian, 1)), 1.5);
    EXPECT_EQ(pixelRadius(withFilter(PixelFilter::blackman_harris, 1)), 1.5);
    EXPECT_EQ(pixelRadius(withFilter(PixelFilter::blackman_harris, 1, 2)), 2);
}

// Of n^2 samples, one lies in each of n x n cells of a pixel. Samples beyond a square number lie
// anywhere in the pixel. Other pixels have other samples.
TEST(PixelFilter, SamplesAreStratified)
{
    for (const int side : {2, 7, 50}) {
        const PixelSampler sampler(withFilter(PixelFilter::box, side * side));
        std::vector<int> count(std::size_t(side * side));
        for (int s = 0; s < side * side; ++s) {
            const Vec3d p = sampler.position(3, 5, s);
            const int row = int((p[1] - 5) * side), column = int((p[0] - 3) * side);
            ++count[row * side + column];
        }
        EXPECT_EQ(count, std::vector<int>(count.size(), 1)) << side;
    }
    const PixelSampler seven(withFilter(PixelFilter::box, 7));
    Vec3d sum(0.0);
    for (int x = 0; x < 8; ++x)
        for (int s = 4; s < 7; ++s) {
            const Vec3d p = seven.position(x, 2, s) - Vec3d(x, 2, 0);
            EXPECT_TRUE(p[0] >= 0 && p[0] < 1 && p[1] >= 0 && p[1] < 1) << p;
            sum += p / 24.0;
        }
    for (int a = 0; a < 2; ++a)
        EXPECT_NEAR(sum[a], 0.5, 4 * std::sqrt(1 / 12.0 / 24)); // four standard errors
    const Vec3d here = seven.position(3, 5, 0);
    EXPECT_NE(seven.position(4, 5, 0) - here, Vec3d(1, 0, 0));
    EXPECT_NE(seven.position(3, 6, 0) - here, Vec3d(0, 1, 0));
}

// A picture whose samples are not all taken yet is not moved: the mean of the first n samples over
// many pixels is the pixels' centre. Samples of one pixel repel each other, so that independent
// ones bound the error.
TEST(PixelFilter, TheFirstSamplesLieAroundTheCentre)
{
    constexpr int kRows = 300;
    for (const PixelFilter filter : kFilters)
        for (const int side : {2, 3, 7, 16}) {
            const PixelSampler sampler(withFilter(filter, side * side + 1, 0.5));
            for (const int n : {1, 2, side, side * side / 2, side * side, side * side + 1}) {
                Vec3d sum(0.0);
                for (int y = 0; y < kRows; ++y)
                    for (int x = 0; x < 8; ++x)
                        for (int s = 0; s < n; ++s)
                            sum += sampler.position(x, y, s) - Vec3d(x + 0.5, y + 0.5, 0);
                const double bound = 4.5 * std::sqrt(1 / 12.0 / (8.0 * kRows * n));
                for (int a = 0; a < 2; ++a)
                    EXPECT_NEAR(sum[a] / (8.0 * kRows * n), 0, bound) << side << " " << n;
            }
        }
}

// Over many pixels, any two samples fall into each pair of different cells equally often: chi
// square with its mean and five standard deviations.
TEST(PixelFilter, EveryOrderOfTheCellsIsAsLikely)
{
    constexpr int kRows = 4000;
    for (const int side : {2, 3, 5}) {
        const int cells = side * side;
        const PixelSampler sampler(withFilter(PixelFilter::box, cells));
        for (const auto& [first, second] :
             {std::pair(0, 1), std::pair(0, cells - 1), std::pair(cells / 2, cells / 2 + 1)}) {
            std::vector<double> count(std::size_t(cells * cells));
            for (int y = 0; y < kRows; ++y)
                for (int x = 0; x < 8; ++x) {
                    const auto cell = [&](int sample) {
                        const Vec3d p = sampler.position(x, y, sample);
                        return int((p[1] - y) * side) * side + int((p[0] - x) * side);
                    };
                    ++count[cell(first) * cells + cell(second)];
                }
            const double free = cells * (cells - 1.0) - 1, expected = 8.0 * kRows / (free + 1);
            double square = 0;
            for (int a = 0; a < cells; ++a)
                for (int b = 0; b < cells; ++b) {
                    const double c = count[a * cells + b];
                    if (a == b) EXPECT_EQ(c, 0);
                    else square += (c - expected) * (c - expected) / expected;
                }
            EXPECT_LT(square, free + 5 * std::sqrt(2 * free)) << side << " " << first;
        }
    }
}

TEST(PixelFilter, SamplesLieAsTheFilterWeighs)
{
    for (const PixelFilter filter : kFilters)
        for (const double radius : {0.5, 1.5, 3.0}) {
            const PixelSampler sampler(withFilter(filter, 2500, radius));
            for (const double part : {-0.8, -0.3, 0.0, 0.25, 0.6}) {
                int below[2] = {0, 0};
                for (int s = 0; s < 2500; ++s)
                    for (int a = 0; a < 2; ++a)
                        below[a] += sampler.position(3, 5, s)[a] < (a ? 5.5 : 3.5) + part * radius;
                for (const int b : below) // one row of the 50 x 50 grid is 0.02
                    EXPECT_NEAR(b / 2500.0, weightBelow(filter, radius, part * radius), 0.021)
                        << part;
            }
            for (const double u : {0.0, 0.1, 0.5, 0.97, 1.0}) {
                EXPECT_NEAR(weightBelow(filter, radius, sampler.warp(u)), u, 2e-3);
                EXPECT_LE(std::abs(sampler.warp(u)), radius * 1.000001);
                EXPECT_NEAR(sampler.warp(u), -sampler.warp(1 - u), 1e-6 * radius);
            }
        }
}

TEST(PixelFilter, OneSampleIsThePixelsCentre)
{
    for (const PixelFilter filter : kFilters)
        EXPECT_EQ(PixelSampler(withFilter(filter, 1)).position(3, 5, 0), Vec3d(3.5, 5.5, 0));
}

// If an opaque body has its edge inside a pixel, its alpha there is the filter's weight on its
// side. The same holds for its colour.
TEST(PixelFilter, AnEdgeShowsTheFiltersIntegral)
{
    Volume volume = emptyVolume();
    volume.parts[0].density->fill(openvdb::CoordBBox({0, -16, -4}, {31, 15, 3}), 100.0f,
                                  true); // from x = -0.5 on
    Camera camera;
    camera.projection = Projection::orthographic;
    camera.eye = {0, 0, 50};
    camera.width = 8; // a pixel is 1 wide; the edge is at 3.5 pixels
    Light light;
    light.direction = {0, 0, -1};
    for (const PixelFilter filter : kFilters) {
        RenderParams params = withFilter(filter, 1024);
        params.shadows = Shadows::none;
        const Image image = render(volume, {}, camera, {light}, params);
        const double bright = image.pixel(7, 4)[0];
        for (int x = 0; x < 8; ++x) {
            const double expected = 1 - weightBelow(filter, pixelRadius(params), 3.5 - (x + 0.5));
            EXPECT_NEAR(image.pixel(x, 4)[3], expected, 0.02) << x; // a row of the grid is 0.03
            EXPECT_NEAR(image.pixel(x, 4)[0], bright * expected, 0.02 * bright) << x;
        }
    }
}
