// SPDX-License-Identifier: Apache-2.0
// Soft shadows of skins and of a volume against closed forms, and which part of the lights a
// sample sees by.
#include "volcomp/render/soft_lights.h"

#include <cmath>
#include <set>

#include <gtest/gtest.h>

#include "tests/support/skins.h"
#include "tests/support/volumes.h"
#include "volcomp/base/parallel.h"
#include "volcomp/render/explain.h"
#include "volcomp/render/render.h"
#include "volcomp/render/tree/voxel_levels.h"
#include "volcomp/view/soft_light.h"

namespace volcomp {
namespace {

constexpr double kHalf = 0.15; ///< of the sun's disc, radians

Light sun(double disc = 2 * kHalf)
{
    Light light;
    light.name = "sun";
    light.direction = {0, 0, -1};
    light.disc = disc;
    return light;
}

RenderParams paramsOf(Shadows shadows, int samples = 16, int light_samples = 16)
{
    RenderParams p;
    p.width = 60;
    p.height = 2;
    p.samples = samples;
    p.light_samples = light_samples;
    p.shadows = shadows;
    p.cutoff = 0;
    return p;
}

/// Looks along -z at z = 0 over x from -1 to 1, from z = `height`.
Camera above(double height)
{
    Camera c;
    c.projection = Projection::orthographic;
    c.eye = {0.0013, 0.0021, height};
    c.target = {0.0013, 0.0021, 0};
    c.width = 2;
    return c;
}

/// What is seen of a disc of radius 1 beyond a line at distance q from its middle.
double beyond(double q)
{
    if (std::abs(q) >= 1) return q > 0 ? 0 : 1;
    return (std::acos(q) - q * std::sqrt(1 - q * q)) / kPi;
}

/// The greatest difference of R, a column's mean, from f(x of its middle) over what it is at most.
template <class F>
double worst(const Image& image, F&& f)
{
    double most = 0;
    for (int x = 0; x < image.width; ++x) {
        double mean = 0;
        for (int y = 0; y < image.height; ++y) mean += image.pixel(x, y)[0] / image.height;
        most =
            std::max(most, std::abs(mean - f((x + 0.5) * 2 / image.width - 1 + above(1).eye[0])));
    }
    return most;
}

/// A wall in z = 0, and over its half with x < 0 a board at z = 2.
SkinTracer wallAndBoard()
{
    std::vector<SkinMesh> meshes;
    meshes.push_back(skinMesh(squareMesh(Vec3d(0.0), Vec3d(0, 0, 1), 40), wallMaterial(1)));
    meshes.push_back(skinMesh(squareMesh(Vec3d(-20, 0, 2), Vec3d(0, 0, 1), 40), wallMaterial(1)));
    return SkinTracer(std::move(meshes));
}

/// A wall of fog that lets nothing through, under z = 0.
Volume ground()
{
    Volume v = emptyVolume(1.0 / 32);
    v.parts[0].density->fill(openvdb::CoordBBox({-40, -4, -8}, {39, 3, -1}), 1000, true);
    return v;
}

Material matt(double alpha = 1)
{
    Material m;
    m.alpha = alpha;
    m.beta = 0;
    return m;
}

} // namespace

TEST(SoftLights, APixelSeesEveryPartAndNeighboursShareThem)
{
    for (const auto& [samples, parts] : {std::pair{8, 8}, {64, 16}, {16, 5}})
        for (int x = 0; x < 9; ++x)
            for (int first = 0; first + parts <= samples; ++first) {
                std::set<int> seen;
                for (int s = first; s < first + parts; ++s)
                    seen.insert(lightPart(x, 7, s, samples, parts));
                EXPECT_EQ(int(seen.size()), parts);
                EXPECT_EQ(*seen.begin(), 0);
                EXPECT_EQ(*seen.rbegin(), parts - 1);
            }
    for (const auto& [samples, parts] : {std::pair{4, 16}, {2, 8}, {4, 8}, {3, 8}}) {
        std::set<int> seen;
        for (int x = 0; x < 2; ++x)
            for (int y = 0; y < 2; ++y)
                for (int s = 0; s < samples; ++s)
                    seen.insert(lightPart(10 + x, 20 + y, s, samples, parts));
        EXPECT_EQ(int(seen.size()), parts) << samples << ' ' << parts;
    }
}

TEST(SoftLights, AStraightEdgesPenumbraIsTheShareOfTheDiscThatIsSeen)
{
    const SkinTracer skins = wallAndBoard();
    const auto show = [&](const Light& light, const RenderParams& params) {
        return render(emptyVolume(), {}, above(1), {light}, params, {}, nullptr, &skins);
    };
    // The disc as it is seen through the plane of the board.
    const auto seen = [](double x) { return beyond(-x / 2 / std::tan(kHalf)); };
    Light lamp = sun(0);
    lamp.kind = LightKind::patch;
    lamp.position = {0, 0, 6};
    lamp.strength = Vec3d(36.0);
    lamp.radius = 0.6;
    // From x the edge is seen on the lamp's plane at -2 x / 4 from its middle: the edge throws a
    // shadow three times ... (6 - 0) / 2 as far from itself as the lamp's place is.
    const auto of_lamp = [](double x) {
        const double at = x + (0 - x) * 6 / 2; // where the way by the edge meets the lamp's plane
        const double cosine = 6 / std::hypot(6.0, x);
        return beyond(at / 0.6) * std::pow(cosine, 4);
    };
    for (const Shadows shadows : {Shadows::exact, Shadows::sweep}) {
        EXPECT_LT(worst(show(sun(), paramsOf(shadows, 64, 16)), seen), 0.12);
        EXPECT_LT(worst(show(sun(), paramsOf(shadows, 256, 64)), seen), 0.05);
        EXPECT_GT(worst(show(sun(0), paramsOf(shadows, 64)), seen), 0.3) << "a hard one";
        EXPECT_LT(worst(show(lamp, paramsOf(shadows, 64, 16)), of_lamp), 0.12);
        EXPECT_LT(worst(show(lamp, paramsOf(shadows, 256, 64)), of_lamp), 0.06);
    }
}

// The same edge over fog, which the sweep lights; the fog's surface shows 1/4 of the light.
TEST(SoftLights, SkinsThrowSoftShadowsOnAVolume)
{
    std::vector<SkinMesh> meshes;
    meshes.push_back(skinMesh(squareMesh(Vec3d(-20, 0, 2), Vec3d(0, 0, 1), 40), wallMaterial(1)));
    const SkinTracer board(std::move(meshes));
    for (const Shadows shadows : {Shadows::exact, Shadows::sweep}) {
        const auto show = [&](const Light& light, int parts) {
            return render(ground(), {matt()}, above(1), {light},
                          paramsOf(shadows, 4 * parts, parts), {}, nullptr, &board);
        };
        const Image open = render(ground(), {matt()}, above(1), {sun(0)}, paramsOf(shadows));
        const double full = open.pixel(30, 1)[0];
        EXPECT_LT(worst(show(sun(), 16),
                        [&](double x) { return full * beyond(-x / 2 / std::tan(kHalf)); }),
                  0.12 * full);
    }
}

// Without anything in its way a soft light is as bright as a hard one, but for the cosine and the
// falloff over its size.
TEST(SoftLights, TheMeanStays)
{
    const auto wall = tracerOf(skinMesh(squareMesh(Vec3d(0.0), Vec3d(0, 0, 1), 40)));
    Light lamp;
    lamp.kind = LightKind::point;
    lamp.position = {0.3, 0.2, 3};
    lamp.strength = Vec3d(9.0);
    for (Light light : {sun(0), lamp}) {
        const auto show = [&](int parts) {
            return render(emptyVolume(), {}, above(1), {light}, paramsOf(Shadows::exact, 16, parts),
                          {}, nullptr, wall.get());
        };
        const Image hard = show(16);
        light.disc = 2 * kHalf;
        light.radius = 0.4;
        const Image soft = show(16);
        for (int x = 0; x < 60; ++x) {
            const double cosine = light.kind == LightKind::point ? 1 : 0.5 * (1 + std::cos(kHalf));
            EXPECT_NEAR(soft.pixel(x, 1)[0] / hard.pixel(x, 1)[0], cosine, 0.01) << x;
        }
    }
}

TEST(SoftLights, OneSampleAPixelSeesTheMiddle)
{
    const SkinTracer skins = wallAndBoard();
    const auto show = [&](const Light& light) {
        return render(emptyVolume(), {}, above(1), {light}, paramsOf(Shadows::sweep, 1), {},
                      nullptr, &skins);
    };
    EXPECT_EQ(show(sun()).pixels, show(sun(0)).pixels);
}

// Tiles, threads, crops and pauses make no difference; light_samples makes none to hard lights.
TEST(SoftLights, ThreadsCropsAndPausesMakeNoDifference)
{
    const SkinTracer skins = wallAndBoard();
    const std::vector<Light> lights{sun(0), sun()};
    RenderParams params = paramsOf(Shadows::sweep, 6, 4);
    params.aovs = true;
    const auto show = [&](const RenderParams& p, RenderWatch* watch = nullptr,
                          const Progress& progress = {}) {
        const auto tree = std::make_shared<const VoxelTree>(ground());
        const std::vector<VoxelLevel> levels = voxelLevels(tree, above(1), p);
        return render(levels, {matt()}, above(1), lights, p, progress, nullptr, watch, &skins);
    };
    Image one;
    {
        const ThreadLimit limit(1);
        one = show(params);
    }
    EXPECT_EQ(one.pixels, show(params).pixels);
    RenderWatch preview;
    preview.preview = true;
    preview.update = [](const RenderState&, const Image&) {};
    EXPECT_EQ(one.pixels, show(params, &preview).pixels);
    RenderWatch stopped;
    std::atomic<bool> stop{false};
    stopped.stop = &stop;
    stopped.preview = true;
    stopped.update = [](const RenderState&, const Image&) {};
    EXPECT_THROW(show(params, &stopped, [&](double part) { stop = stop || part > 0.4; }), Stopped);
    EXPECT_GT(stopped.state.samples.at(0), 0);
    stop = false;
    EXPECT_EQ(one.pixels, show(params, &stopped).pixels);

    params.crop = {17, 1, 20, 1};
    params.shadows = Shadows::exact;
    const Image crop = show(params);
    params.crop = {};
    const Image whole = show(params);
    for (int x = 0; x < 20; ++x)
        for (std::size_t c = 0; c < crop.channels.size(); ++c)
            EXPECT_EQ(crop.pixel(x, 0)[c], whole.pixel(17 + x, 1)[c]);

    const auto hard = [&](int light_samples) {
        RenderParams p = paramsOf(Shadows::sweep, 6, light_samples);
        return render(ground(), {matt()}, above(1), {sun(0)}, p, {}, nullptr, &skins).pixels;
    };
    EXPECT_EQ(hard(1), hard(16));
}

// The statistics say what arrives: here half of the light, as the board is over half of the wall.
TEST(SoftLights, StatisticsAreOfTheWholeLight)
{
    const SkinTracer skins = wallAndBoard();
    Light behind = sun(0), lamp = sun();
    behind.direction = {0, 0, 1};
    lamp.strength = Vec3d(3.0);
    RenderStats stats;
    RenderParams params = paramsOf(Shadows::exact, 16);
    const std::vector<Light> lights{sun(), lamp, behind};
    const auto show = [&] {
        render(emptyVolume(), {}, above(1), lights, params, {}, &stats, &skins);
        ASSERT_EQ(stats.lights.size(), 3u);
    };
    show();
    EXPECT_NEAR(stats.lights[0].arrives, 0.5, 0.01);
    EXPECT_NEAR(stats.lights[1].arrives, 0.5, 0.01);
    EXPECT_LT(stats.lights[2].arrives, 0) << "it shines on nothing that is seen";
    EXPECT_EQ(stats.lights[2].seen, 0);
    // Each light is asked at places at random of its own.
    EXPECT_NEAR(stats.lights[0].seen, 0.25, 5e-3);
    EXPECT_NEAR(stats.lights[1].seen, 0.75, 5e-3);
    EXPECT_EQ(stats.ambient_seen, 0);
    params.ambient = Vec3d(0.5); // of which the board keeps a part away
    show();
    EXPECT_NEAR(stats.lights[1].seen / stats.lights[0].seen, 3, 0.05);
    EXPECT_GT(stats.ambient_seen, 0.05);
    EXPECT_LT(stats.ambient_seen, 0.2);
    EXPECT_NEAR(stats.lights[0].seen + stats.lights[1].seen + stats.ambient_seen, 1, 1e-9);
}

} // namespace volcomp
