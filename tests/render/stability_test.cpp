// Where methods fail (MODEL section 10), for light: each test shows the plain method failing and
// ours holding. stability_march_test.cpp has the rays.
#include <cmath>

#include <gtest/gtest.h>

#include "volcomp/render/march/integrator.h"
#include "volcomp/render/render.h"
#include "tests/support/volumes.h"

using namespace volcomp;

// Thin steps: 1 - exp(-x) loses its digits; thick ones: the sum (4) darkens.
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
        double plain = 0, light_left = 1; // in doubles, the exponential subtracted
        for (int i = 0; i < 32; ++i, light_left *= std::exp(-double(x)))
            plain += light_left * (1 - std::exp(-double(x)));
        if (x <= 1e-8f) {
            EXPECT_GT(std::abs(0.25 * plain / truth - 1), 1e-10) << x;
        }
    }
}

// Light along a segment where exp underflows: 0 times infinity in the plain form.
TEST(Stability, LightAlongASegmentNeitherOverflowsNorLosesDigits)
{
    const auto plain = [](double a, double x) { return std::exp(-a) * (1 - std::exp(-x)) / x; };
    const auto integral =
        [](double a,
           double x) { // of e^-(a + x s), s from 0 to 1: the part that matters, by Simpson's rule
            const double nearest = x > 0 ? a : a + x, rate = std::abs(x),
                         reach = rate > 40 ? 40 / rate : 1;
            constexpr int kSteps = 20000;
            double sum = 0;
            for (int i = 0; i <= kSteps; ++i)
                sum += (i == 0 || i == kSteps ? 1
                            : i % 2           ? 4
                                              : 2)
                    * std::exp(-nearest - rate * reach * i / kSteps);
            return sum * reach / (3 * kSteps);
        };
    for (const double a : {0.0, 1.0, 30.0, 650.0, 800.0, 5000.0})
        for (const double x : {0.0, 1e-12, -1e-9, 1e-3, -1.0, 30.0, -30.0, 650.0, -800.0, -5000.0,
                               1e5, 9e-6, -9e-6, 2e-5, -2e-5}) {
            if (a + x < 0) continue; // no depth is below 0
            const double expected = integral(a, x), found = segmentLight(a, x);
            EXPECT_TRUE(std::isfinite(found)) << a << " " << x;
            EXPECT_NEAR(found, expected, 1e-9 * expected + 1e-300) << a << " " << x;
        }
    EXPECT_FALSE(std::isfinite(plain(800, -800))); // 0 * inf
    EXPECT_NEAR(segmentLight(800, -800), 1.0 / 800, 1e-9);
    EXPECT_GT(std::abs(plain(0, 1e-12) - 1), 1e-6); // 1 - exp(-1e-12)
    EXPECT_FALSE(std::isfinite(plain(1, 0)));       // 0 / 0
}

// Shading as printed divides by what may be nothing.
TEST(Stability, ShadingIsBoundedWhereThePrintedFormIsNot)
{
    const auto fresnel = [](double c, double n) { // as printed
        const double g = std::sqrt(n * n + c * c - 1), a = (g - c) / (g + c),
                     b = (c * (g + c) - 1) / (c * (g - c) + 1);
        return 0.5 * a * a * (1 + b * b);
    };
    EXPECT_FALSE(std::isfinite(fresnel(0, 1)));     // n = 1, grazing
    EXPECT_FALSE(std::isfinite(fresnel(0.1, 0.5))); // beyond the critical angle
    Material m;
    m.alpha = 0;
    m.beta = 1;
    const auto bounded = [&](const Vec3d& direction, const Vec3d& V, const Vec3d& L,
                             double most_fibre, double most_surface) {
        for (const MaterialKind kind : {MaterialKind::fibre, MaterialKind::surface}) {
            m.kind = kind;
            const Lobe lobe = makeLobe(m);
            const Reflection r = kind == MaterialKind::fibre
                ? reflectFibre(lobe, direction, V, L)
                : reflectSurface(lobe, direction, V, L);
            const double most = kind == MaterialKind::fibre ? most_fibre : most_surface;
            EXPECT_TRUE(r.specular >= 0 && r.specular <= most && r.diffuse >= 0) << r.specular;
        }
    };
    for (const double n : {0.5, 1.0, 1.55})
        for (const double gamma : {0.0, 0.001, 0.5, 3.0}) {
            m.n = n;
            m.gamma = gamma;
            const Vec3d V = Vec3d(1, 0, 1e-5).unit(), L = Vec3d(-1, 0, 2e-5).unit();
            bounded({0, 0, 1}, {1, 0, 0}, {-1, 0, 0}, 0, 0); // V = -L, both grazing: |V + L| = 0
            bounded({0, 0, 1}, Vec3d(1, 0, 1e-9).unit(), Vec3d(-1, 0, 1e-9).unit(), 0,
                    0);                       // nearly so: none below 1e-6
            bounded({0, 0, 1}, V, L, 1, 1e2); // grazing: 1 / cos theta_r is 100 at most
            bounded({1, 0, 0}, {1, 0, 0}, {1, 0, 0}, 0,
                    1); // along the fibre: it has no normal there
            bounded(Vec3d(1 + 1e-7, 1e-8, 0), Vec3d(1 + 1e-7, 0, 0), Vec3d(1 + 1e-7, 1e-9, 0), 0,
                    2); // lengths rounded above 1
            bounded(Vec3d(1 + 1e-7, 0, 0), Vec3d(1 + 1e-7, 0, 0), Vec3d(0, 1, 0), 1,
                    1e2); // acos of that
        }
    EXPECT_TRUE(std::isnan(std::acos(1 + 1e-7)));
    const auto printed = [](const Vec3d& N, const Vec3d& V,
                            const Vec3d& L) { // G / cos theta_r of (9)
        const Vec3d Q = (V + L).unit();
        return std::min(
                   {1.0, 2 * N.dot(Q) * N.dot(V) / V.dot(Q), 2 * N.dot(Q) * N.dot(L) / V.dot(Q)})
            / N.dot(V);
    };
    const Vec3d V = Vec3d(1, 0, 1e-5).unit(), L = Vec3d(-1, 0, 2e-5).unit();
    EXPECT_GT(printed({0, 0, 1}, V, L), 9e4);
    const double phi = 0, gamma = 0;
    EXPECT_TRUE(std::isnan(
        std::exp(-std::log(2.0) * phi * phi / (gamma * gamma)))); // the lobe at gamma = 0
}

// A ray that ends where less light than `cutoff` passes is off by no more than that part of the
// brightest.
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
                         missing = 0.25 - found; // 128 voxels let e^-25.6 pass
            EXPECT_LE(missing, 0.25 * cutoff) << cutoff;
            EXPECT_GT(missing, 0.25 * 0.8 * cutoff)
                << cutoff; // and it ends there: a voxel passes e^-0.2
        }
}

// Lights that stand in the volume, on the ray itself, in a face where a segment ends.
TEST(Stability, ALightOnTheRayIsFinite)
{
    Volume volume = emptyVolume();
    volume.parts[0].density->fill(openvdb::CoordBBox({-4, -4, -4}, {3, 3, 3}), 0.2f, true);
    const VoxelTree tree(volume);
    std::vector<Light> lights(3);
    lights[0].kind = LightKind::point;
    lights[1].kind = LightKind::spot;
    lights[2].kind = LightKind::patch;
    for (const double z : {0.5, 0.0, -0.3}) // of the world: 0.5 is a face
        for (const Filter filter : {Filter::box, Filter::trilinear})
            for (Light& light : lights) {
                light.position = {0.25, 0.25, z};
                RenderParams params;
                params.filter = filter;
                Integrator::Scratch scratch;
                const RaySample sample = Integrator(tree, {Material()}, {light}, params)
                                             .trace({0.25, 0.25, 20}, {0, 0, -1}, scratch);
                EXPECT_TRUE(sample.radiance[0] >= 0 && sample.radiance[0] <= 0.8)
                    << z; // alpha / 4 at half a voxel, and no nearer
                EXPECT_TRUE(light.kind != LightKind::point || sample.radiance[0] > 0.01) << z;
            }
}

// Nothing, and one voxel near, at negative coordinates and far away, through the whole renderer.
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
