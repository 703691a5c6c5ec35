// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/explain.h"

#include <array>
#include <cmath>
#include <set>
#include <sstream>

#include <gtest/gtest.h>

#include "volcomp/base/error.h"
#include "volcomp/base/random.h"
#include "volcomp/render/render.h"
#include "volcomp/render/tree/voxel_levels.h"
#include "tests/support/message_of.h"
#include "tests/support/volumes.h"

using namespace volcomp;

namespace {

constexpr int kSize = 14; ///< of the volume, voxels
const std::string kNames[] = {"hair", "leaf"};

/// Two parts that overlap, fibres and surfaces, with directions of any spread and voxels without
/// one.
const VoxelTree& tree()
{
    static const VoxelTree t = [] {
        Random random(6);
        Volume volume;
        for (const MaterialKind kind : {MaterialKind::fibre, MaterialKind::surface}) {
            VolumePart& part = volume.parts.emplace_back(emptyPart());
            part.material = kNames[volume.parts.size() - 1];
            part.kind = kind;
            part.direction = openvdb::Vec3SGrid::create(Vec3f(0.0f));
            part.colour = openvdb::Vec3SGrid::create(Vec3f(0.0f));
            for (int n = 0; n < kSize * kSize * kSize; ++n) {
                if (random.uniform() < 0.7) continue;
                const openvdb::Coord at(n % kSize - 7, n / kSize % kSize - 7,
                                        n / kSize / kSize - 7);
                part.density->tree().setValue(at, float(random.uniform(0.05, 0.8)));
                part.colour->tree().setValue(
                    at, Vec3f(float(random.uniform()), 0.5f, float(random.uniform())));
                if (random.uniform() < 0.2) continue;
                const Vec3d d = Vec3d(random.normal(), random.normal(), random.normal()).unit();
                part.direction->tree().setValue(at, Vec3f(random.uniform(0.2, 1) * d));
            }
        }
        return VoxelTree(volume);
    }();
    return t;
}

std::vector<Material> materials()
{
    std::vector<Material> result(2);
    result[0].name = kNames[0];
    result[1].name = kNames[1];
    result[1].kind = MaterialKind::surface;
    result[1].alpha = 0.5;
    return result;
}

/// So near that the pixels are as wide as voxels of the finest level before the volume's middle,
/// and as those of the next behind it.
Camera camera()
{
    Camera c;
    c.eye = {2, 3, 12};
    c.field_of_view = 0.9;
    return c;
}

std::vector<Light> lights()
{
    std::vector<Light> result(3);
    result[0].direction = Vec3d(-0.6, -0.7, -0.4).unit();
    result[0].name = "sun";
    result[1].kind = LightKind::point;
    result[1].position = {9, 12, 3};
    result[1].strength = {90, 80, 10};
    result[2].kind = LightKind::spot; // dark at first where the cone does not reach
    result[2].position = {-12, 2, 3};
    result[2].direction = Vec3d(1, 0, -0.2).unit();
    result[2].angle = 0.5;
    result[2].strength = {0, 90, 200};
    return result;
}

/// Checks the listed terms one by one and adds them up to a pixel of a render.
void expectSumsTo(const float* pixel, const RayExplanation& e, const RenderParams& params,
                  const std::vector<Light>& the_lights, double& scattered)
{
    const bool sums = params.integration == Integration::riemann;
    Vec3d radiance(0.0);
    double T = 1;
    for (const ExplainedInterval& interval : e.intervals) {
        ASSERT_NEAR(interval.transmittance, T, 1e-9);
        if (sums) T *= std::exp(-interval.depth); // the sum (4) as printed
        const double weight = T * (sums ? interval.depth : -std::expm1(-interval.depth));
        if (!sums) T *= std::exp(-interval.depth);
        ASSERT_NEAR(interval.weight, weight, 1e-9);
        double share = 0;
        Vec3d ambient(0.0);
        for (const ExplainedPart& part : interval.parts) {
            share += part.share;
            ambient += part.share * materials()[part.material == kNames[1]].alpha * part.colour
                * params.ambient;
        }
        ASSERT_NEAR(share, 1, 1e-9);
        for (int c = 0; c < 3; ++c)
            if (params.shadows == Shadows::none) {
                ASSERT_NEAR(interval.ambient[c], weight * ambient[c], 1e-6);
            } else { // less arrives, but with bounces an albedo below 1 may show more
                ASSERT_GE(interval.ambient[c], 0);
                ASSERT_LE(interval.ambient[c], weight * params.ambient[c] * 1.000001);
            }
        for (const ExplainedLight& light : interval.lights) {
            const Vec3d middle = e.origin + 0.5 * (interval.begin + interval.end) * e.direction;
            const Vec3d strength = the_lights[light.light].strength
                * illuminate(the_lights[light.light], middle, 0.5 * interval.voxel_size).weight;
            const Vec3d term = weight * light.transmittance * light.reflected;
            for (int c = 0; c < 3; ++c) {
                ASSERT_NEAR(light.strength[c], strength[c], 1e-6 * std::max(1.0, strength[c]));
                ASSERT_NEAR(light.adds[c], term[c], 1e-9);
            }
            if (params.scattering == Scattering::single || params.shadows == Shadows::none) {
                ASSERT_EQ(light.scattered, Vec3d(0.0));
            }
            radiance += term + light.scattered;
            scattered += light.scattered[0];
        }
        radiance += interval.ambient;
    }
    radiance += T * params.background;
    for (int c = 0; c < 3; ++c) {
        ASSERT_NEAR(pixel[c], radiance[c], 1e-5 * std::max(1.0, radiance[c]));
        ASSERT_NEAR(e.radiance[c], radiance[c], 1e-9);
    }
    ASSERT_NEAR(pixel[3], params.background.lengthSqr() > 0 ? 1 : 1 - T, 1e-6);
    ASSERT_NEAR(pixel[3], e.alpha, 1e-6);
}

/// The settings number `n` of all combinations, and their number if n is negative.
struct Combination {
    RenderParams params;
    std::string name;

    static constexpr int kCount = 2 * 2 * 2 * 3 * 2 * 2 * 2 * 2 * 2;
    explicit Combination(int n)
    {
        const auto take = [&n](int choices) {
            const int taken = n % choices;
            n /= choices;
            return taken;
        };
        name = std::to_string(n);
        params.width = 6;
        params.height = 4;
        params.aovs = n % 5 == 1;
        params.scattering = n % 7 < 3 ? Scattering::multiple : Scattering::single;
        params.undirected = n % 3 ? Undirected::isotropic : Undirected::gradient;
        params.background = take(2) ? Vec3d(0.3, 0.7, 2) : Vec3d(0.0);
        params.ambient = take(2) ? Vec3d(0.2, 0.1, 0.4) : Vec3d(0.0);
        if (take(2)) params.crop = {2, 1, 3, 2};
        params.filter = take(2) ? Filter::trilinear : Filter::box;
        params.integration = take(2) ? Integration::riemann : Integration::exact;
        params.step = 0.7;
        params.extinction = take(2) ? Extinction::isotropic : Extinction::directed;
        params.shadows = std::array{Shadows::none, Shadows::exact, Shadows::sweep}[take(3)];
        params.lod = take(2);
        params.cutoff = take(2) ? 0.05 : 0;
    }
};

/// Calls f(params, levels) for every combination of settings.
template <class F>
void forEachCombination(F&& f)
{
    const std::shared_ptr<const VoxelTree> finest(std::shared_ptr<void>(), &tree());
    std::vector<VoxelLevel> levels[2];
    for (const int lod : {0, 1}) {
        RenderParams params = Combination(0).params;
        params.lod = lod;
        levels[lod] = voxelLevels(finest, camera(), params);
    }
    ASSERT_EQ(levels[0].size(), 1u);
    ASSERT_GT(levels[1].size(), 1u);
    for (int n = 0; n < Combination::kCount; ++n) {
        const Combination combination(n);
        SCOPED_TRACE(combination.name);
        f(combination.params, levels[combination.params.lod]);
        if (::testing::Test::HasFatalFailure()) return;
    }
}

} // namespace

TEST(Explain, TermsAddUpToThePixelWithEverySetting)
{
    std::set<std::size_t> levels_met, lights_met;
    std::size_t intervals = 0;
    double scattered = 0;
    forEachCombination([&](const RenderParams& params, const std::vector<VoxelLevel>& levels) {
        const Image image = render(levels, materials(), camera(), lights(), params);
        for (const auto& [x, y] : {std::pair(2, 1), std::pair(4, 2)}) {
            const RayExplanation e = explain(levels, materials(), camera(), lights(), params, x, y);
            expectSumsTo(image.pixel(x - params.crop.x, y - params.crop.y), e, params, lights(),
                         scattered);
            if (::testing::Test::HasFatalFailure()) return;
            intervals += e.intervals.size();
            for (const ExplainedInterval& interval : e.intervals) {
                levels_met.insert(interval.level);
                for (const ExplainedLight& light : interval.lights) lights_met.insert(light.light);
            }
        }
    });
    EXPECT_GT(intervals, 5u * 2 * Combination::kCount);
    EXPECT_GT(scattered, 0);
    EXPECT_EQ(levels_met.size(), 2u);
    EXPECT_EQ(lights_met.size(), 3u);
}

// A render without light sums the depth alone, and ends elsewhere in the dark than one that shades.
TEST(Explain, TermsAddUpWhereNothingShines)
{
    std::vector<Light> dark = lights();
    for (Light& light : dark) light.strength = Vec3d(0.0);
    forEachCombination([&](const RenderParams& params, const std::vector<VoxelLevel>& levels) {
        if (params.ambient.lengthSqr() > 0) return;
        const Image image = render(levels, materials(), camera(), dark, params);
        const RayExplanation e = explain(levels, materials(), camera(), dark, params, 3, 1);
        double none = 0;
        expectSumsTo(image.pixel(3 - params.crop.x, 1 - params.crop.y), e, params, dark, none);
        EXPECT_FALSE(e.intervals.empty());
    });
}

TEST(Explain, RaysThatMeetNothingShowTheBackground)
{
    Camera away = camera();
    away.target = {4, 6, 24};
    RenderParams params;
    params.background = {0.1, 0.2, 0.3};
    const std::shared_ptr<const VoxelTree> finest(std::shared_ptr<void>(), &tree());
    const RayExplanation e =
        explain(voxelLevels(finest, away, params), materials(), away, lights(), params, 0, 0);
    EXPECT_TRUE(e.intervals.empty());
    EXPECT_EQ(e.transmittance, 1);
    EXPECT_EQ(e.radiance, params.background);
}

TEST(Explain, ADomeThatIsSeenStandsBeforeTheBackground)
{
    Camera away = camera();
    away.target = {4, 6, 24};
    RenderParams params;
    params.width = params.height = 4;
    params.background = {0.1, 0.2, 0.3};
    params.dome.kind = DomeKind::gradient;
    params.dome.zenith = {1, 2, 3};
    params.dome.ground = {3, 2, 1};
    const std::shared_ptr<const VoxelTree> finest(std::shared_ptr<void>(), &tree());
    const auto levels = voxelLevels(finest, away, params);
    const auto expectPixel = [&](const Vec3d& colour, double alpha) {
        const Image image = render(levels, materials(), away, lights(), params);
        const RayExplanation e = explain(levels, materials(), away, lights(), params, 1, 2);
        EXPECT_EQ(e.radiance, colour);
        EXPECT_EQ(e.background, colour);
        EXPECT_EQ(e.alpha, alpha);
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(image.pixel(1, 2)[c], colour[c], 1e-6);
        EXPECT_EQ(image.pixel(1, 2)[3], alpha);
    };
    const Vec3d direction = CameraRays(away, 4, 4).ray(1.5, 2.5).direction;
    expectPixel(params.dome.radiance(direction), 1);
    params.dome.visible = false;
    expectPixel(params.background, 1);
    params.background = Vec3d(0.0);
    expectPixel(Vec3d(0.0), 0);
    params.dome.visible = true;
    params.dome.strength = 0;
    expectPixel(Vec3d(0.0), 0);
    params.dome.kind = DomeKind::image;
    params.dome.file = "sky.exr";
    EXPECT_THROW(render(levels, materials(), away, lights(), params), Error) << "it is not loaded";
}

TEST(Explain, PixelsOutsideOfThePictureAreErrors)
{
    RenderParams params;
    params.width = 8;
    params.height = 6;
    const auto messageFor = [&](int x, int y) {
        return messageOf([&] { requirePixel(params, x, y, "--explain"); });
    };
    EXPECT_NO_THROW(requirePixel(params, 0, 0, "--explain"));
    EXPECT_NO_THROW(requirePixel(params, 7, 5, "--explain"));
    EXPECT_EQ(messageFor(8, 5),
              "--explain: expected a pixel of the picture, X from 0 to 7 and Y from 0 to 5, "
              "found 8,5");
    for (const auto& [x, y] : {std::pair(-1, 0), std::pair(0, -1), std::pair(0, 6)})
        EXPECT_NE(messageFor(x, y).find("expected a pixel"), std::string::npos) << x << "," << y;
    params.crop = {2, 1, 3, 2};
    EXPECT_NO_THROW(requirePixel(params, 4, 2, "--explain"));
    EXPECT_EQ(messageFor(5, 2),
              "--explain: expected a pixel of the picture's crop, X from 2 to 4 and Y from 1 to 2, "
              "found 5,2");
    EXPECT_THROW(explain({}, {}, camera(), {}, params, 1, 1), Error);
}

// The printed terms of the lights, the ambient light and the background add up to the printed
// pixel.
TEST(Explain, TheTableAddsUp)
{
    const Combination combination(3); // ambient light and a background
    const std::shared_ptr<const VoxelTree> finest(std::shared_ptr<void>(), &tree());
    const RayExplanation e = explain(voxelLevels(finest, camera(), combination.params), materials(),
                                     camera(), lights(), combination.params, 2, 1);
    std::istringstream table(explanationTable(e, lights()));
    double terms = 0, pixel = 0;
    const auto firstNumberAfter = [](const std::string& line, const std::string& word) {
        return std::stod(line.substr(line.find(word) + word.size()));
    };
    bool in_sums = false;
    for (std::string line; std::getline(table, line);) {
        EXPECT_LE(line.size(), 140u) << line;
        in_sums |= line == "sums";
        if (!in_sums && line.find("adds (") != std::string::npos)
            terms += firstNumberAfter(line, "adds (");
        if (in_sums && line.find("  background") == 0) terms += firstNumberAfter(line, "(");
        if (in_sums && line.find("  pixel") == 0) pixel = firstNumberAfter(line, "(");
    }
    EXPECT_GT(pixel, 0);
    EXPECT_NEAR(terms, pixel, 1e-5 * pixel);
    EXPECT_NEAR(pixel, e.radiance[0], 1e-5 * pixel);
}
