// SPDX-License-Identifier: Apache-2.0
// Pictures of skins that are meshes, alone and beside a volume, against closed forms.
#include <cmath>
#include <functional>

#include <gtest/gtest.h>

#include "tests/support/skins.h"
#include "tests/support/volumes.h"
#include "volcomp/base/parallel.h"
#include "volcomp/render/explain.h"
#include "volcomp/render/render.h"
#include "volcomp/render/shade.h"
#include "volcomp/render/tree/voxel_levels.h"

namespace volcomp {
namespace {

Camera fromFront(double width = 2)
{
    Camera c;
    c.projection = Projection::orthographic;
    c.eye = {0.0013, 0.0021, 5};
    c.target = {0.0013, 0.0021, 0};
    c.width = width;
    return c;
}

Light along(const Vec3d& way, const Vec3d& strength = Vec3d(1.0))
{
    Light l;
    l.direction = way.unit();
    l.strength = strength;
    return l;
}

RenderParams paramsOf(Shadows shadows, int size = 24)
{
    RenderParams p;
    p.width = p.height = size;
    p.shadows = shadows;
    p.cutoff = 0;
    return p;
}

/// Isotropic fog in a block of voxels of 1/32 m, whose centre is about the origin of x and y.
Volume fog(int z_low, int z_high, float density, int half = 40)
{
    Volume v = emptyVolume(1.0 / 32);
    v.parts[0].density->fill(
        openvdb::CoordBBox({-half, -half, z_low}, {half - 1, half - 1, z_high}), density, true);
    return v;
}

Material fogMaterial(double alpha)
{
    Material m;
    m.alpha = alpha;
    return m;
}

constexpr Shadows kAllShadows[] = {Shadows::exact, Shadows::sweep, Shadows::none};

/// The largest relative difference of a channel from `expected` over all pixels.
double worst(const Image& image, double expected, int channel = 0)
{
    double most = 0;
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x)
            most = std::max(most, std::abs(image.pixel(x, y)[channel] / expected - 1));
    return most;
}

double meanOf(const Image& a)
{
    double sum = 0;
    for (int y = 0; y < a.height; ++y)
        for (int x = 0; x < a.width; ++x) sum += a.pixel(x, y)[0];
    return sum / (double(a.width) * a.height);
}

/// Root mean square of the difference of R over the mean of `b`.
double difference(const Image& a, const Image& b)
{
    double square = 0, mean = 0;
    for (int y = 0; y < a.height; ++y)
        for (int x = 0; x < a.width; ++x) {
            const double d = a.pixel(x, y)[0] - b.pixel(x, y)[0];
            square += d * d;
            mean += b.pixel(x, y)[0];
        }
    const double n = double(a.width) * a.height;
    return std::sqrt(square / n) / (mean / n);
}

TEST(SkinPicture, AWallShowsItsColourTimesTheCosine)
{
    const auto wall = tracerOf(skinMesh(squareMesh(Vec3d(0.0), Vec3d(0, 0, 1), 4)));
    const double root3 = std::sqrt(3.0);
    for (const Volume& volume : {emptyVolume(), fog(40, 60, 0), fog(-60, -10, 100)})
        for (const Shadows shadows : kAllShadows)
            for (const Filter filter : {Filter::box, Filter::trilinear})
                for (const bool sums : {false, true}) {
                    RenderParams params = paramsOf(shadows);
                    params.filter = filter;
                    params.integration = sums ? Integration::riemann : Integration::exact;
                    const auto show = [&](const Vec3d& way) {
                        return render(volume, {}, fromFront(), {along(way)}, params, {}, nullptr,
                                      wall.get());
                    };
                    const Image facing = show({0, 0, -1}), slanted = show({root3, 0, -1});
                    EXPECT_LT(worst(facing, 0.8), 1e-6);
                    EXPECT_LT(worst(slanted, 0.4), 1e-6);
                    EXPECT_LT(worst(facing, 1, 3), 1e-6);
                    EXPECT_EQ(show({0, 0, 1}).pixel(3, 3)[0], 0);
                }
}

TEST(SkinPicture, UnderFogTheWallShowsTheSameTimesTheFogsTransmittance)
{
    const auto wall = tracerOf(skinMesh(squareMesh(Vec3d(0.0), Vec3d(0, 0, 1), 10)));
    const double slant = std::sqrt(2.0);
    // Fog that stands on the wall, fog that also lies behind it, and fog at a distance.
    for (const auto& [low, high] : {std::pair{0, 15}, std::pair{-8, 15}, std::pair{6, 21}})
        for (const float depth : {0.2f, 1.5f})
            for (const Shadows shadows : kAllShadows) {
                const double length = (high + 0.5 - std::max(-0.5, double(low) - 0.5)) / 32,
                             above = low < 6 ? length - 0.5 / 32 : length;
                const Volume volume = fog(low, high, float(depth / above), 80);
                const auto show = [&](const Vec3d& way) {
                    return render(volume, {fogMaterial(0)}, fromFront(1), {along(way)},
                                  paramsOf(shadows), {}, nullptr, wall.get());
                };
                const bool shaded = shadows != Shadows::none;
                const double tolerance = shadows == Shadows::sweep ? 0.015 : 1e-5;
                EXPECT_LT(worst(show({0, 0, -1}), 0.8 * std::exp(-depth - shaded * depth)),
                          tolerance)
                    << low << ' ' << depth << ' ' << int(shadows);
                EXPECT_LT(worst(show({1, 0, -1}),
                                0.8 / slant * std::exp(-depth - shaded * slant * depth)),
                          tolerance)
                    << low << ' ' << depth << ' ' << int(shadows);
            }
}

// Fog too thin to shade itself, that stands on the wall: its light is as if there were no wall on
// the lit side, at any angle, and none on the other.
TEST(SkinPicture, WhatStandsOnALitSkinIsLitToItsRoots)
{
    for (const Vec3d& normal : {Vec3d(0, 0, 1), Vec3d(0.3, 0.4, 1).unit()}) {
        const auto wall = tracerOf(skinMesh(squareMesh(Vec3d(0.0), normal, 100), wallMaterial(0)));
        const Volume volume = fog(-16, 7, 0.01f, 80);
        for (const double facing : {1.0, 0.3, 0.05}) {
            const Vec3d aside = normal.cross(Vec3d(1, 0.2, 0)).unit(),
                        L = normal * facing + aside * std::sqrt(1 - facing * facing);
            const auto show = [&](Shadows shadows, const Vec3d& to_light) {
                return render(volume, {fogMaterial(1)}, fromFront(1), {along(-to_light)},
                              paramsOf(shadows), {}, nullptr, wall.get());
            };
            const Image bare = show(Shadows::none, L);
            ASSERT_GT(meanOf(bare), 1e-4);
            for (const Shadows shadows : {Shadows::exact, Shadows::sweep}) {
                EXPECT_LT(difference(show(shadows, L), bare), 0.03) << facing << int(shadows);
                EXPECT_LT(meanOf(show(shadows, L - normal * (2 * facing))),
                          (shadows == Shadows::exact ? 1e-6 : 0.1) * meanOf(bare))
                    << facing << int(shadows);
            }
        }
    }
}

TEST(SkinPicture, ABallHasItsOutlineAndTheCosineOfItsNormals)
{
    const auto ball = tracerOf(skinMesh(ballMesh(Vec3d(0.0), 0.7, 200)));
    RenderParams params = paramsOf(Shadows::exact, 40);
    params.samples = 64;
    const Vec3d L = Vec3d(1, 1, 1).unit();
    const Image image =
        render(emptyVolume(), {}, fromFront(), {along(-L)}, params, {}, nullptr, ball.get());
    double covered = 0;
    for (int y = 0; y < 40; ++y)
        for (int x = 0; x < 40; ++x) covered += image.pixel(x, y)[3];
    EXPECT_NEAR(covered / 1600 * 4, kPi * 0.49, 0.002);
    params.samples = 1;
    params.aovs = true;
    const Image sharp =
        render(emptyVolume(), {}, fromFront(), {along(-L)}, params, {}, nullptr, ball.get());
    for (int y = 0; y < 40; ++y)
        for (int x = 0; x < 40; ++x) {
            const float* p = sharp.pixel(x, y);
            const Vec3d at((x + 0.5) / 20 - 1 + 0.0013, 1 - (y + 0.5) / 20 + 0.0021, 0);
            const double r = at.length();
            if (r > 0.69) continue;
            const Vec3d n = Vec3d(at[0], at[1], std::sqrt(0.49 - r * r)) / 0.7;
            const double facing = n.dot(L);
            if (std::abs(facing) > 0.02) {
                EXPECT_NEAR(p[0], 0.8 * std::max(0.0, facing), 0.002);
            }
            EXPECT_NEAR(p[4], 5 - n[2] * 0.7, 0.001); // Z
            for (int c = 0; c < 3; ++c) {
                EXPECT_NEAR(p[5 + c], n[c], 0.01);
                EXPECT_NEAR(p[8 + c], 0.8, 1e-6);   // albedo
                EXPECT_NEAR(p[11 + c], p[c], 1e-6); // the light
            }
        }
}

TEST(SkinPicture, BothSidesShowTheSameAndTheHighlightIsTorranceSparrows)
{
    const Material shiny = wallMaterial(0.5, 0.7);
    const Vec3d N(0, 0, 1), V(0, 0, 1), L = Vec3d(0.2, 0.1, 1).unit();
    const Reflection expected = reflectSurface(makeLobe(shiny), N, V, L);
    ASSERT_GT(expected.specular, 0.01);
    for (const Vec3d& normal : {N, -N}) {
        const auto wall =
            tracerOf(skinMesh(squareMesh(Vec3d(0.0), normal, 4), shiny, Vec3d(0.2, 0.4, 0.6)));
        const Image image = render(emptyVolume(), {}, fromFront(), {along(-L)},
                                   paramsOf(Shadows::exact), {}, nullptr, wall.get());
        for (int c = 0; c < 3; ++c)
            EXPECT_NEAR(image.pixel(5, 5)[c], expected.diffuse * 0.2 * (c + 1) + expected.specular,
                        1e-6);
    }
}

TEST(SkinPicture, LampsFallOffAndSkinsShadowEachOther)
{
    std::vector<SkinMesh> meshes;
    meshes.push_back(skinMesh(squareMesh(Vec3d(0.0), Vec3d(0, 0, 1), 4)));
    meshes.push_back(skinMesh(squareMesh(Vec3d(0.5, 0, 1), Vec3d(0, 0, 1), 0.5)));
    const SkinTracer skins(std::move(meshes));
    Light lamp;
    lamp.kind = LightKind::point;
    lamp.position = {0, 0, 2};
    lamp.strength = Vec3d(3.0);
    Camera camera = fromFront(4);
    camera.eye[2] = 0.5; // between the two
    for (const Shadows shadows : {Shadows::exact, Shadows::sweep}) {
        const Image image =
            render(emptyVolume(), {}, camera, {lamp}, paramsOf(shadows, 40), {}, nullptr, &skins);
        for (int y = 0; y < 40; ++y)
            for (int x = 0; x < 40; ++x) {
                const Vec3d at((x + 0.5) / 10 - 2 + 0.0013, 2 - (y + 0.5) / 10 + 0.0021, 0);
                const double d2 = at.lengthSqr() + 4;
                const bool dark = at[0] > 0.5 && at[0] < 1.5 && std::abs(at[1]) < 0.5;
                EXPECT_NEAR(image.pixel(x, y)[0], dark ? 0 : 0.8 * 3 / d2 * 2 / std::sqrt(d2), 1e-5)
                    << x << ' ' << y;
            }
    }
}

TEST(SkinPicture, ASkinHidesWhatIsBehindAndTheCutoffHidesTheSkin)
{
    const auto wall = tracerOf(skinMesh(squareMesh(Vec3d(0.0), Vec3d(0, 0, 1), 4)));
    RenderParams params = paramsOf(Shadows::none);
    params.background = Vec3d(1, 1, 1);
    params.ambient = Vec3d(0.5);
    const Volume both = fog(-60, 60, 2);
    const Image with =
        render(both, {fogMaterial(1)}, fromFront(), {}, params, {}, nullptr, wall.get());
    // Half of the voxel around 0 lies before the wall.
    const double passes = std::exp(-2 * 60.5 / 32);
    EXPECT_NEAR(with.pixel(4, 4)[0], 0.5 * (1 - passes) + 0.5 * 0.8 * passes, 1e-5);
    params.shadows = Shadows::exact;
    params.cutoff = 2 * passes;
    params.ambient = Vec3d(0.0);
    const Image cut = render(both, {fogMaterial(1)}, fromFront(), {along({0, 0, -1})}, params, {},
                             nullptr, wall.get());
    const Image bare = render(both, {fogMaterial(1)}, fromFront(), {along({0, 0, -1})}, params);
    EXPECT_LT(cut.pixel(4, 4)[0], bare.pixel(4, 4)[0]);
    EXPECT_NEAR(cut.pixel(4, 4)[0], bare.pixel(4, 4)[0], 1.1 * params.cutoff);
}

/// A ball with a thin shell of fog around it, and a board that throws a shadow on both.
struct Furry {
    Volume volume = emptyVolume(1.0 / 32);
    std::unique_ptr<SkinTracer> skins;
    Furry()
    {
        for (int x = -36; x < 36; ++x)
            for (int y = -36; y < 36; ++y)
                for (int z = -36; z < 36; ++z) {
                    const double r = Vec3d(x, y, z).length() / 32;
                    if (r > 0.68 && r < 1)
                        volume.parts[0].density->tree().setValue({x, y, z}, 2.5f);
                }
        std::vector<SkinMesh> meshes;
        meshes.push_back(skinMesh(ballMesh(Vec3d(0.0), 0.7, 60)));
        meshes.push_back(skinMesh(squareMesh(Vec3d(1.3, 0.2, 1), Vec3d(1, 0, 1).unit(), 0.9)));
        skins = std::make_unique<SkinTracer>(std::move(meshes));
    }
    Image show(const std::vector<Light>& lights, RenderParams params) const
    {
        return render(volume, {fogMaterial(0.9)}, fromFront(3), lights, params, {}, nullptr,
                      skins.get());
    }
};

std::vector<Light> manyLights()
{
    Light lamp = along({-1, -1, -1}, Vec3d(2, 4, 2));
    lamp.kind = LightKind::spot;
    lamp.position = {1.5, 1.5, 1.5};
    lamp.angle = 0.5;
    Light inside = lamp;
    inside.kind = LightKind::point;
    inside.position = {0, 0.3, 0.85};
    inside.strength = Vec3d(0.02, 0.05, 0.1);
    return {along({-1, -0.3, -1}), along({1, -2, 0.2}, Vec3d(0.2, 0.5, 1)), lamp, inside};
}

TEST(SkinPicture, SweptShadowsOfSkinsAgreeWithRays)
{
    const Furry furry;
    for (const Light& light : manyLights()) {
        RenderParams params = paramsOf(Shadows::exact, 64);
        const Image exact = furry.show({light}, params);
        params.shadows = Shadows::sweep;
        const Image swept = furry.show({light}, params);
        // In which 0.02 are the sweep's of the fog.
        EXPECT_LT(difference(swept, exact), 0.05) << int(light.kind) << light.direction;
        EXPECT_NEAR(meanOf(swept) / meanOf(exact), 1, 0.01) << int(light.kind) << light.direction;
    }
}

TEST(SkinPicture, ThreadsCropsAndLightsDoNotMix)
{
    const Furry furry;
    for (const Shadows shadows : {Shadows::exact, Shadows::sweep}) {
        RenderParams params = paramsOf(shadows, 32);
        params.aovs = true;
        params.samples = 2;
        Image whole;
        {
            const ThreadLimit one(1);
            whole = furry.show(manyLights(), params);
        }
        const Image other = furry.show(manyLights(), params);
        EXPECT_EQ(whole.pixels, other.pixels);
        // R is the sum of the lights'.
        for (int x = 0; x < 32; ++x) {
            const float* p = whole.pixel(x, 16);
            EXPECT_NEAR(p[0], p[11] + p[14] + p[17] + p[20], 1e-5);
        }
        params.crop = {7, 5, 16, 12};
        const Image crop = furry.show(manyLights(), params);
        double most = 0;
        for (int y = 0; y < 12; ++y)
            for (int x = 0; x < 16; ++x)
                most = std::max(
                    most, double(std::abs(crop.pixel(x, y)[0] - whole.pixel(x + 7, y + 5)[0])));
        EXPECT_LE(most, shadows == Shadows::exact ? 0 : 0.01);
    }
}

TEST(SkinPicture, TheExplanationAddsUpToThePixel)
{
    const Furry furry;
    for (const Shadows shadows : {Shadows::exact, Shadows::sweep}) {
        RenderParams params = paramsOf(shadows, 31);
        params.ambient = Vec3d(0.1);
        const Image image = furry.show(manyLights(), params);
        const auto levels =
            voxelLevels(std::make_shared<const VoxelTree>(furry.volume), fromFront(3), params);
        const RayExplanation e = explain(levels, {fogMaterial(0.9)}, fromFront(3), manyLights(),
                                         params, 16, 13, furry.skins.get());
        ASSERT_TRUE(e.skin);
        EXPECT_GT(e.intervals.size(), 4u);
        EXPECT_NEAR(e.skin->distance, 4.3, 0.1);
        EXPECT_EQ(e.skin->surface, "surface");
        EXPECT_EQ(e.alpha, 1);
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(e.radiance[c], image.pixel(16, 13)[c], 1e-5);
        EXPECT_NE(explanationTable(e, manyLights()).find("skin of surface 'surface' (wall)"),
                  std::string::npos);
    }
}

TEST(SkinPicture, LevelsOfDetailEndOnTheSkinToo)
{
    const auto wall = tracerOf(skinMesh(squareMesh(Vec3d(0.0), Vec3d(0, 0, 1), 10)));
    for (const Shadows shadows : {Shadows::exact, Shadows::sweep}) {
        RenderParams params = paramsOf(shadows, 12);
        params.lod = true; // a pixel is 2.7 voxels wide
        const Image image = render(fog(-32, 31, 1), {fogMaterial(0)}, fromFront(1),
                                   {along({0, 0, -1})}, params, {}, nullptr, wall.get());
        // Coarse voxels end at 32 too.
        const double depth = 31.5 / 32;
        EXPECT_LT(worst(image, 0.8 * std::exp(-2 * depth)), 0.02) << int(shadows);
    }
}

TEST(SkinPicture, RaysGoThroughSeveralLevelsToTheGround)
{
    // A long low fog on the ground, under a board, seen along it: pixels are 1 to 8 voxels wide.
    Volume volume = emptyVolume(1.0 / 32);
    volume.parts[0].density->fill(openvdb::CoordBBox({-64, 0, -256}, {63, 15, 63}), 0.3f, true);
    std::vector<SkinMesh> meshes;
    meshes.push_back(skinMesh(squareMesh(Vec3d(0, -1.0 / 64, -3), Vec3d(0, 1, 0), 24)));
    meshes.push_back(skinMesh(squareMesh(Vec3d(0.3, 1.5, -4), Vec3d(0, 1, 0), 1.5)));
    const SkinTracer skins(std::move(meshes));
    Camera camera;
    camera.eye = {0.01, 1.2, 2.5};
    camera.target = {0, 0, -3};
    for (const Shadows shadows : {Shadows::exact, Shadows::sweep}) {
        RenderParams params = paramsOf(shadows, 24);
        params.samples = 4;
        const auto show = [&](bool lod) {
            params.lod = lod;
            return render(volume, {fogMaterial(1)}, camera, {along({0.1, -1, 0.2})}, params, {},
                          nullptr, &skins);
        };
        const Image coarse = show(true), fine = show(false);
        params.lod = true;
        EXPECT_GT(voxelLevels(std::make_shared<const VoxelTree>(volume), camera, params).size(),
                  2u);
        EXPECT_NEAR(meanOf(coarse) / meanOf(fine), 1, 0.01) << int(shadows);
        EXPECT_LT(difference(coarse, fine), 0.03) << int(shadows);
        for (int x = 0; x < 24; ++x) EXPECT_NEAR(coarse.pixel(x, 20)[3], 1, 1e-6);
    }
}

} // namespace
} // namespace volcomp
