// SPDX-License-Identifier: Apache-2.0
// Haze in pictures against closed forms and fine sums, and the parts of a picture against the
// whole.
#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/skins.h"
#include "tests/support/volumes.h"
#include "volcomp/base/interval.h"
#include "volcomp/render/explain.h"
#include "volcomp/render/render.h"
#include "volcomp/render/tree/voxel_levels.h"

namespace volcomp {
namespace {

Haze haze(double density, double height, double base = 0)
{
    Haze h;
    h.colour = {0.7, 0.5, 0.2};
    h.density = density;
    h.height = height;
    h.base = base;
    return h;
}

/// Sees along `way` through the origin, from a distance of 5.
Camera along(const Vec3d& way)
{
    Camera c;
    c.projection = Projection::orthographic;
    c.eye = Vec3d(0.0013, 0.0021, 0.0007) - 5 * way;
    c.target = c.eye + way;
    c.width = 1e-6;
    return c;
}

RenderParams paramsOf(Shadows shadows = Shadows::none)
{
    RenderParams p;
    p.width = p.height = 2;
    p.shadows = shadows;
    p.cutoff = 0;
    return p;
}

Light light()
{
    Light l;
    l.direction = Vec3d(0.2, -0.4, -1).unit();
    l.strength = {1, 2, 3};
    return l;
}

/// Two blocks of fog of 24 voxels of 1/16 m with a gap along z; the first is thicker.
Volume fog()
{
    Volume v = emptyVolume(1.0 / 16);
    v.parts[0].density->fill(openvdb::CoordBBox({-40, -40, -24}, {39, 39, -9}), 0.6f, true);
    v.parts[0].density->fill(openvdb::CoordBBox({-40, -40, 8}, {39, 39, 23}), 1.5f, true);
    return v;
}

/// Its density at a place.
double fogDensity(const Vec3d& p)
{
    const double z = std::floor(p[2] * 16 + 0.5);
    return z >= 8 && z <= 23 ? 1.5 : z >= -24 && z <= -9 ? 0.6 : 0;
}

std::vector<Material> matt(double alpha)
{
    Material m;
    m.alpha = alpha;
    m.beta = 0;
    return {m};
}

const Haze kHazes[] = {haze(0, 0), haze(0.08, 0), haze(0.3, 1.5), haze(0.02, 3, 4), haze(2, 0.5)};
const Vec3d kWays[] = {{0, 0, -1}, Vec3d(0.1, 0.5, -1).unit(), Vec3d(0.1, -0.5, -1).unit()};

} // namespace

TEST(HazePicture, TheBackgroundFadesIntoIt)
{
    for (const Haze& h : kHazes)
        for (const Vec3d& way : kWays)
            for (const bool seen : {false, true}) {
                RenderParams params = paramsOf();
                params.haze = h;
                if (seen) params.background = {0.1, 3, 0.4};
                const Camera camera = along(way);
                const double T = HazeRay(h, camera.eye, way).transmittance(kInfinity);
                const Image image = render(emptyVolume(), {}, camera, {}, params);
                for (int c = 0; c < 3; ++c)
                    EXPECT_NEAR(image.pixel(0, 1)[c],
                                T * params.background[c] + (1 - T) * h.colour[c], 1e-4);
                EXPECT_NEAR(image.pixel(0, 1)[3], seen ? 1 : 1 - T, 1e-4);
            }
}

TEST(HazePicture, AWallFadesIntoIt)
{
    const auto wall = tracerOf(skinMesh(squareMesh(Vec3d(0.0), Vec3d(0, 0, 1), 40)));
    for (const Haze& h : kHazes)
        for (const Vec3d& way : kWays) {
            RenderParams params = paramsOf(Shadows::sweep);
            params.ambient = Vec3d(0.3);
            const auto show = [&] {
                return render(emptyVolume(), {}, along(way), {light()}, params, {}, nullptr,
                              wall.get());
            };
            const Image clear = show();
            params.haze = h;
            const Image hazy = show();
            const double T =
                HazeRay(h, along(way).eye, way).transmittance(along(way).eye[2] / -way[2]);
            for (int c = 0; c < 3; ++c)
                EXPECT_NEAR(hazy.pixel(1, 0)[c], T * clear.pixel(1, 0)[c] + (1 - T) * h.colour[c],
                            2e-3);
        }
}

// Both media in one ray, summed in steps of 0.1 mm: what the fog sends, weakened by both; what the
// haze sends, weakened by both.
TEST(HazePicture, HazeAndVolumeAreOneMedium)
{
    for (const Filter filter : {Filter::box, Filter::trilinear})
        for (const Haze& h : kHazes)
            for (const Vec3d& way : kWays) {
                RenderParams params = paramsOf();
                params.filter = filter;
                params.background = {0.1, 3, 0.4};
                const Camera camera = along(way);
                // Without haze the fog, all of the same colour, shows its share of that colour.
                const Image clear = render(fog(), matt(1), camera, {light()}, params);
                params.haze = h;
                const Image hazy = render(fog(), matt(1), camera, {light()}, params);

                double T = 1, fogs = 0, fog_alone = 1;
                Vec3d hazes(0.0);
                constexpr double kStep = 1e-4;
                for (double t = 0.5 * kStep; t < 12; t += kStep) {
                    const Vec3d p = camera.eye + t * way;
                    const double mist = h.density
                        * (h.height > 0 ? std::exp(-(p[1] - h.base) / h.height) : 1),
                                 dense = fogDensity(p), lost = -std::expm1(-(mist + dense) * kStep);
                    if (mist + dense > 0) {
                        fogs += T * lost * dense / (mist + dense);
                        hazes += T * lost * mist / (mist + dense) * h.colour;
                    }
                    T *= 1 - lost;
                    fog_alone *= std::exp(-dense * kStep);
                }
                const double beyond =
                    HazeRay(h, camera.eye + 12 * way, way).transmittance(kInfinity);
                for (int c = 0; c < 3; ++c) {
                    const double shown =
                        (clear.pixel(0, 0)[c] - fog_alone * params.background[c]) / (1 - fog_alone);
                    const double expected = fogs * shown + hazes[c]
                        + T * (beyond * params.background[c] + (1 - beyond) * h.colour[c]);
                    EXPECT_NEAR(hazy.pixel(0, 0)[c], expected, 1e-3 * (1 + expected))
                        << h.density << ' ' << h.height << ' ' << way;
                }
            }
}

namespace {

double channel(const Image& image, int x, int y, const std::string& name)
{
    const auto at = std::find(image.channels.begin(), image.channels.end(), name);
    EXPECT_NE(at, image.channels.end()) << name;
    return image.pixel(x, y)[at - image.channels.begin()];
}

} // namespace

// Lights, ambient, background and haze are all of the picture, with every way to compute it.
TEST(HazePicture, ThePartsAddUpToThePicture)
{
    std::vector<SkinMesh> meshes;
    meshes.push_back(skinMesh(ballMesh(Vec3d(0, 0, -0.8), 1, 30)));
    const SkinTracer ball(std::move(meshes));
    Light key = light(), lamp = light();
    key.name = "key";
    key.disc = 0.3;
    lamp.kind = LightKind::point;
    lamp.name = "lamp";
    lamp.position = {1.2, 0.3, 1};
    Camera camera = along(Vec3d(0.1, -0.3, -1).unit());
    camera.width = 6;
    for (int n = 0; n < 2 * 3 * 2 * 2 * 2 * 2 * 2; ++n) {
        int rest = n;
        const auto take = [&](int choices) {
            const int taken = rest % choices;
            rest /= choices;
            return taken;
        };
        RenderParams params = paramsOf();
        params.width = params.height = 6;
        params.aovs = true;
        params.filter = take(2) ? Filter::trilinear : Filter::box;
        params.shadows = std::array{Shadows::none, Shadows::exact, Shadows::sweep}[take(3)];
        params.integration = take(2) ? Integration::riemann : Integration::exact;
        params.scattering = take(2) ? Scattering::multiple : Scattering::single;
        if (take(2)) {
            params.ambient = {0.3, 0.4, 0.5};
            params.background = {0.2, 1, 2};
        }
        if (take(2)) {
            params.dome.kind = DomeKind::gradient;
            params.dome.zenith = {0.2, 0.3, 0.6};
            params.dome.horizon = {0.8, 0.7, 0.7};
            params.dome.ground = {0.1, 0.2, 0.1};
        }
        if (take(2)) params.haze = haze(0.1, 2);
        params.samples = 1 + n % 3;
        const Image image =
            render(fog(), matt(0.7), camera, {key, lamp}, params, {}, nullptr, &ball);
        double background = 0, hazes = 0, ambient = 0;
        for (int y = 0; y < 6; ++y)
            for (int x = 0; x < 6; ++x)
                for (const char* c : {"R", "G", "B"}) {
                    double sum = 0;
                    for (const char* part : {"key", "lamp", "ambient", "background", "haze"})
                        sum += channel(image, x, y, std::string(part) + "." + c);
                    const double whole = channel(image, x, y, c);
                    ASSERT_NEAR(sum, whole, 1e-5 * std::max(1.0, whole)) << n;
                    background += channel(image, x, y, std::string("background.") + c);
                    hazes += channel(image, x, y, std::string("haze.") + c);
                    ambient += channel(image, x, y, std::string("ambient.") + c);
                }
        EXPECT_EQ(hazes > 0, !params.haze.none());
        if (params.ambient[0] > 0) {
            EXPECT_EQ(background > 0, params.haze.none()) << "no ray leaves this haze";
            EXPECT_GT(ambient, 0);
        }
        // And so are the terms of an explanation.
        params.samples = 1;
        const auto tree = std::make_shared<const VoxelTree>(fog());
        const std::vector<VoxelLevel> levels = voxelLevels(tree, camera, params);
        const Image one =
            render(levels, matt(0.7), camera, {key, lamp}, params, {}, nullptr, nullptr, &ball);
        const RayExplanation e =
            explain(levels, matt(0.7), camera, {key, lamp}, params, 2, 3, &ball);
        for (int c = 0; c < 3; ++c)
            ASSERT_NEAR(e.radiance[c], one.pixel(2, 3)[c], 1e-5 * (1 + e.radiance[c])) << n;
    }
}

} // namespace volcomp
