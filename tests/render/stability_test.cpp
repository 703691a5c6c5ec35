// SPDX-License-Identifier: Apache-2.0
// Where methods fail (MODEL section 10), for light: at the inputs where the plain method fails,
// ours gives the right answer. stability_march_test.cpp has the rays.
#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "volcomp/render/march/integrator.h"
#include "volcomp/render/render.h"
#include "volcomp/render/shade.h"
#include "tests/support/volumes.h"

using namespace volcomp;

// A lit slab of 32 voxels shows (1 - exp(-32 x)) / 4, x the optical depth of a voxel. For thin ones
// 1 - exp(-x) loses its digits; for thick ones the paper's sum (4) is too dark.
TEST(Stability, TheClosedFormHoldsFromThinToThickSteps)
{
    Material material;
    material.alpha = 1;
    Light light;
    light.direction = {0, 0, -1};
    const std::vector<Light> lights{light};
    RenderParams params;
    params.shadows = Shadows::none;
    params.cutoff = 0;
    double subtracted_is_off = 0; // most relative error of sums of T (1 - exp(-x))
    for (const float x : {1e-12f, 1e-8f, 1e-4f, 0.1f, 1.0f, 10.0f, 750.0f, 1e6f}) {
        Volume volume = emptyVolume();
        volume.parts[0].density->fill(openvdb::CoordBBox({0, 0, 0}, {7, 7, 31}), x, true);
        const VoxelTree tree(volume);
        const double truth = 0.25 * -std::expm1(-32.0 * double(x));
        Integrator::Scratch scratch;
        const auto found = [&](Integration integration) {
            params.integration = integration;
            return Integrator(tree, {material}, lights, params)
                .trace({3.1, 3.2, 40.003}, {0, 0, -1}, scratch)
                .radiance[0];
        };
        EXPECT_NEAR(found(Integration::exact) / truth, 1, 1e-12) << x;
        if (x >= 0.1f) {
            EXPECT_LT(found(Integration::riemann) / truth, 0.96) << x;
        }
        double subtracted = 0, light_left = 1;
        for (int i = 0; i < 32; ++i, light_left *= std::exp(-double(x)))
            subtracted += light_left * (1 - std::exp(-double(x)));
        subtracted_is_off = std::max(subtracted_is_off, std::abs(0.25 * subtracted / truth - 1));
    }
    EXPECT_GT(subtracted_is_off, 1e-6); // or no x is thin enough to matter
}

// The light along a segment, against Simpson's rule: the integral of exp(-a - x s) for s from 0 to
// 1. The printed form, exp(-a) (1 - exp(-x)) / x, is 0 / 0 at x = 0, loses its digits near it and
// is 0 times infinity where exp(-x) overflows.
TEST(Stability, LightAlongASegmentNeitherOverflowsNorLosesDigits)
{
    const auto integral = [](double a, double x) {
        // Only the part within 40 optical depths of the brighter end matters.
        const double nearest = x > 0 ? a : a + x, rate = std::abs(x),
                     reach = rate > 40 ? 40 / rate : 1;
        constexpr int kSteps = 20000;
        double sum = 0;
        for (int i = 0; i <= kSteps; ++i) {
            const int weight = i == 0 || i == kSteps ? 1 : i % 2 ? 4 : 2;
            sum += weight * std::exp(-nearest - rate * reach * i / kSteps);
        }
        return sum * reach / (3 * kSteps);
    };
    int printed_fails = 0;
    for (const double a : {0.0, 1.0, 30.0, 650.0, 800.0, 5000.0})
        for (const double x : {0.0, 1e-12, -1e-9, 1e-3, -1.0, 30.0, -30.0, 650.0, -800.0, -5000.0,
                               1e5, 9e-6, -9e-6, 2e-5, -2e-5}) {
            if (a + x < 0) continue; // an optical depth is not negative
            const double expected = integral(a, x), tolerance = 1e-9 * expected + 1e-300;
            EXPECT_NEAR(segmentLight(a, x), expected, tolerance) << a << " " << x;
            const double printed = std::exp(-a) * (1 - std::exp(-x)) / x;
            printed_fails += !(std::abs(printed - expected) <= tolerance);
        }
    EXPECT_GE(printed_fails, 6 + 4 + 2); // x = 0, x = 1e-12, overflow
    EXPECT_NEAR(segmentLight(800, -800), 1.0 / 800, 1e-9);
}

// The printed Fresnel term, where it is a number, and its limits elsewhere: at grazing angles with
// n = 1 it is 0 / 0, and beyond the critical angle the root of a negative number.
TEST(Stability, FresnelIsThePrintedFormOrItsLimit)
{
    const auto printed = [](double c, double n) {
        const double g = std::sqrt(n * n + c * c - 1), a = (g - c) / (g + c),
                     b = (c * (g + c) - 1) / (c * (g - c) + 1);
        return 0.5 * a * a * (1 + b * b);
    };
    int no_number = 0;
    for (const double n : {0.5, 0.9, 1.0, 1.33, 2.4})
        for (int i = 0; i <= 100; ++i) {
            const double c = i / 100.0, expected = printed(c, n);
            if (std::isfinite(expected))
                EXPECT_NEAR(fresnel(c, n), expected, 1e-12) << c << " " << n;
            else EXPECT_EQ(fresnel(c, n), n == 1 ? 0 : 1) << c << " " << n;
            no_number += !std::isfinite(expected);
        }
    EXPECT_GT(no_number, 100);
}

// Light and view along the normal: Q, N, V and L are the same, so that D = G = 1 and the specular
// term is F, ((n - 1) / (n + 1))^2, for every gamma, also 0, where the printed D is 0 / 0; and for
// vectors that are longer than 1 by a rounding, where the printed acos(N Q) is no number.
TEST(Stability, TheHighlightAlongTheNormalIsTheNormalReflectance)
{
    Material m;
    m.kind = MaterialKind::surface;
    m.alpha = 0;
    m.beta = 1;
    for (const double n : {0.5, 1.0, 1.55, 2.4})
        for (const double gamma : {0.0, 0.001, 0.5, 3.0})
            for (const double length : {1.0, 1 + 1e-7}) {
                m.n = n;
                m.gamma = gamma;
                const Vec3d z(0, 0, length);
                EXPECT_NEAR(reflectSurface(makeLobe(m), z, z, z).specular,
                            (n - 1) * (n - 1) / ((n + 1) * (n + 1)), 1e-6)
                    << n << " " << gamma << " " << length;
            }
}

// Where V nears -L, or the light or the view grazes, the printed terms divide by almost nothing:
// G / cos theta_r of (9) is 1e5 for the directions below, and 100 with the bounds of MODEL 4.
TEST(Stability, ShadingIsBoundedWhereThePrintedFormIsNot)
{
    const Vec3d N(0, 0, 1), V = Vec3d(1, 0, 1e-5).unit(), L = Vec3d(-1, 0, 2e-5).unit(),
                            Q = (V + L).unit();
    const double printed =
        std::min({1.0, 2 * N.dot(Q) * N.dot(V) / V.dot(Q), 2 * N.dot(Q) * N.dot(L) / V.dot(Q)})
        / N.dot(V);
    EXPECT_NEAR(printed, 1e5, 1e3);
    struct Case {
        Vec3d direction, V, L;
        double most_fibre, most_surface; ///< upper bounds of the specular term
    };
    const std::vector<Case> cases{
        {N, {1, 0, 0}, {-1, 0, 0}, 0, 0},                               // V = -L: no half vector
        {N, Vec3d(1, 0, 1e-9).unit(), Vec3d(-1, 0, 1e-9).unit(), 0, 0}, // |V + L| < 1e-6
        {N, V, L, 1, 100},                                              // 1 / cos theta_r <= 100
        {{1, 0, 0}, {1, 0, 0}, {1, 0, 0}, 0, 1}, // a fibre has no normal along itself
        {{1 + 1e-7, 1e-8, 0}, {1 + 1e-7, 0, 0}, {1 + 1e-7, 1e-9, 0}, 0, 2}, // longer than 1
        {{1 + 1e-7, 0, 0}, {1 + 1e-7, 0, 0}, {0, 1, 0}, 1, 100}};
    Material m;
    m.alpha = 0;
    m.beta = 1;
    for (const double n : {0.5, 1.0, 1.55})
        for (const double gamma : {0.0, 0.001, 0.5, 3.0})
            for (const Case& c : cases) {
                m.n = n;
                m.gamma = gamma;
                m.kind = MaterialKind::fibre;
                const Reflection fibre = reflectFibre(makeLobe(m), c.direction, c.V, c.L);
                EXPECT_TRUE(fibre.specular >= 0 && fibre.specular <= c.most_fibre)
                    << n << " " << gamma << " " << fibre.specular;
                EXPECT_TRUE(fibre.diffuse >= 0);
                m.kind = MaterialKind::surface;
                const Reflection surface = reflectSurface(makeLobe(m), c.direction, c.V, c.L);
                EXPECT_TRUE(surface.specular >= 0 && surface.specular <= c.most_surface)
                    << n << " " << gamma << " " << surface.specular;
                EXPECT_TRUE(surface.diffuse >= 0);
            }
}

// A ray ends where less than the fraction `cutoff` of the light passes. What it misses is at most
// that fraction of the brightest, 0.25; it misses more than e^-0.2 of that, as one voxel more would
// have passed e^-0.2 and the ray did not go on. The 128 voxels together pass e^-25.6.
TEST(Stability, TheCutoffBoundsTheError)
{
    Volume volume = emptyVolume();
    volume.parts[0].density->fill(openvdb::CoordBBox({0, 0, 0}, {7, 7, 127}), 0.2f, true);
    const VoxelTree tree(volume);
    Material material;
    material.alpha = 1;
    Light light;
    light.direction = {0, 0, -1};
    RenderParams params;
    params.shadows = Shadows::none;
    Integrator::Scratch scratch;
    for (const Filter filter : {Filter::box, Filter::trilinear})
        for (const double cutoff : {0.3, 0.01, 1e-5}) {
            params.filter = filter;
            params.cutoff = cutoff;
            const double found = Integrator(tree, {material}, {light}, params)
                                     .trace({3.1, 3.2, 140}, {0, 0, -1}, scratch)
                                     .radiance[0],
                         missing = 0.25 - found;
            EXPECT_LE(missing, 0.25 * cutoff) << cutoff;
            EXPECT_GT(missing, 0.25 * 0.8 * cutoff) << cutoff;
        }
}

// Lights stand in the volume, on the ray itself, also in a face, where a segment ends. No voxel is
// lit from nearer than half a voxel, where the light of strength 1 is 4 times as strong as at 1
// unit: 4 alpha / 4 = 0.8 at most.
TEST(Stability, ALightOnTheRayIsFinite)
{
    Volume volume = emptyVolume();
    volume.parts[0].density->fill(openvdb::CoordBBox({-4, -4, -4}, {3, 3, 3}), 0.2f, true);
    const VoxelTree tree(volume);
    std::vector<Light> lights(3);
    lights[0].kind = LightKind::point;
    lights[1].kind = LightKind::spot;
    lights[2].kind = LightKind::patch;
    for (const double z : {0.5, 0.0, -0.3}) // 0.5 is a face
        for (const Filter filter : {Filter::box, Filter::trilinear})
            for (Light& light : lights) {
                light.position = {0.25, 0.25, z};
                RenderParams params;
                params.filter = filter;
                Integrator::Scratch scratch;
                const RaySample sample = Integrator(tree, {Material()}, {light}, params)
                                             .trace({0.25, 0.25, 20}, {0, 0, -1}, scratch);
                EXPECT_TRUE(sample.radiance[0] >= 0 && sample.radiance[0] <= 0.8) << z;
                EXPECT_TRUE(light.kind != LightKind::point || sample.radiance[0] > 0.01) << z;
            }
}

// The whole renderer with an empty volume, and with a single voxel at the origin, at negative
// coordinates and far away.
TEST(Stability, EmptyVolumesAndSingleVoxels)
{
    RenderParams params;
    params.width = params.height = 9;
    params.cutoff = 0;
    params.shadows = Shadows::none;
    Camera camera;
    camera.projection = Projection::orthographic;
    camera.width = 9;
    for (const Shadows shadows : {Shadows::none, Shadows::exact, Shadows::sweep}) {
        params.shadows = shadows;
        const Image image = render(emptyVolume(), {}, camera, {Light()}, params);
        for (const float p : image.pixels) EXPECT_EQ(p, 0);
    }
    for (const openvdb::Coord& at : {openvdb::Coord(0), openvdb::Coord(-7, -9, -1),
                                     openvdb::Coord(1000000, -1000000, 1000000)}) {
        Volume volume = emptyVolume();
        volume.parts[0].density->tree().setValue(at, 0.7f);
        camera.target = at.asVec3d();
        camera.eye = camera.target + Vec3d(0, 0, 50);
        const Image image = render(volume, {}, camera, {}, params);
        for (int y = 0; y < 9; ++y)
            for (int x = 0; x < 9; ++x)
                EXPECT_NEAR(image.pixel(x, y)[3], x == 4 && y == 4 ? -std::expm1(-double(0.7f)) : 0,
                            1e-6)
                    << at;
    }
}
