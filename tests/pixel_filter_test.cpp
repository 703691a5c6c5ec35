#include "pixel_filter.h"

#include <cmath>

#include <gtest/gtest.h>

#include "render.h"

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

constexpr PixelFilter kFilters[] = {PixelFilter::box, PixelFilter::gaussian, PixelFilter::blackman_harris};

// The part of the filter's weight below x pixels from the centre, by sums.
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

TEST(PixelFilter, SamplesLieAsTheFilterWeighs)
{
    for (const PixelFilter filter : kFilters)
        for (const double radius : {0.5, 1.5, 3.0}) {
            const PixelSampler sampler(withFilter(filter, 2500, radius));
            for (const double part : {-0.8, -0.3, 0.0, 0.25, 0.6}) {
                int below = 0;
                for (int s = 0; s < 2500; ++s) below += sampler.position(3, 5, s)[0] < 3.5 + part * radius;
                EXPECT_NEAR(below / 2500.0, weightBelow(filter, radius, part * radius), 0.025)
                    << part; // one row of the 50 x 50 grid is 0.02
            }
            for (const double u : {0.0, 0.1, 0.5, 0.97, 1.0}) {
                EXPECT_NEAR(weightBelow(filter, radius, sampler.warp(u)), u, 2e-3);
                EXPECT_LE(std::abs(sampler.warp(u)), radius * 1.000001);
            }
        }
}

TEST(PixelFilter, OneSampleIsThePixelsCentre)
{
    for (const PixelFilter filter : kFilters) EXPECT_EQ(PixelSampler(withFilter(filter, 1)).position(3, 5, 0), Vec3d(3.5, 5.5, 0));
}

// The alpha of an opaque body with an edge inside a pixel is the weight on its side, in colour as well.
TEST(PixelFilter, AnEdgeShowsTheFiltersIntegral)
{
    VolumePart part;
    part.density = openvdb::FloatGrid::create(0.0f);
    part.density->setTransform(openvdb::math::Transform::createLinearTransform(1.0));
    part.density->fill(openvdb::CoordBBox({0, -16, -4}, {31, 15, 3}), 100.0f, true); // from x = -0.5 on
    Volume volume;
    volume.parts.push_back(part);
    Camera camera;
    camera.projection = Projection::orthographic;
    camera.eye = {0, 0, 50};
    camera.width = 8; // pixels of 1; the edge is at 3.5 pixels
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
