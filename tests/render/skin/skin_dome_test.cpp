// SPDX-License-Identifier: Apache-2.0
// Light from all around on skins, against closed forms and the white furnace.
#include "volcomp/render/skin/skin_dome.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/skins.h"
#include "tests/support/volumes.h"
#include "volcomp/base/parallel.h"
#include "volcomp/render/explain.h"
#include "volcomp/render/render.h"
#include "volcomp/render/tree/voxel_levels.h"

namespace volcomp {
namespace {

constexpr Scattering kBoth[] = {Scattering::single, Scattering::multiple};

Camera fromFront(double width, double z = 5)
{
    Camera c;
    c.projection = Projection::orthographic;
    c.eye = {0.0013, 0.0021, z};
    c.target = {0.0013, 0.0021, 0};
    c.width = width;
    return c;
}

RenderParams underDome(double radiance, Scattering scattering, int size = 8, int samples = 16)
{
    RenderParams p;
    p.width = p.height = size;
    p.samples = samples;
    p.cutoff = 0;
    p.scattering = scattering;
    p.dome.colour = Vec3d(radiance);
    return p;
}

std::unique_ptr<SkinTracer> tracerOf(Mesh a, const Material& of_a, Mesh b, const Material& of_b)
{
    std::vector<SkinMesh> meshes;
    meshes.push_back(skinMesh(std::move(a), of_a));
    meshes.push_back(skinMesh(std::move(b), of_b));
    return std::make_unique<SkinTracer>(std::move(meshes));
}

Image show(const SkinTracer& skins, const RenderParams& params, const Camera& camera,
           const Volume& volume = emptyVolume())
{
    return render(volume, {}, camera, {}, params, {}, nullptr, &skins);
}

/// Mean and root mean square difference from `expected` of R.
struct Figures {
    double mean = 0, rms = 0;
    Figures(const Image& image, double expected)
    {
        const double n = double(image.width) * image.height;
        for (int y = 0; y < image.height; ++y)
            for (int x = 0; x < image.width; ++x) {
                const double v = image.pixel(x, y)[0];
                mean += v / n;
                rms += (v - expected) * (v - expected) / n;
            }
        rms = std::sqrt(rms);
    }
};

/// The part of a plane's cosine-weighted sky that a square of edge `size` covers, which is parallel
/// at the distance h and has its middle above the place (Howell's catalogue, B-4, four times).
double formFactor(double size, double h)
{
    const double a = 0.5 * size / h, r = std::sqrt(1 + a * a);
    return 4 / (2 * kPi) * 2 * a / r * std::atan(a / r);
}

} // namespace

TEST(SkinDome, InTheOpenAWallShowsItsColour)
{
    const auto wall = tracerOf(skinMesh(squareMesh(Vec3d(0.0), Vec3d(0, 0, 1), 4)));
    for (const Scattering scattering : kBoth)
        for (const Shadows shadows : {Shadows::exact, Shadows::sweep, Shadows::none}) {
            RenderParams params = underDome(0.5, scattering);
            params.ambient = Vec3d(0.5);
            params.shadows = shadows;
            EXPECT_LT(Figures(show(*wall, params, fromFront(2)), 0.8).rms, 1e-6);
        }
}

// For radiance that goes linearly with the angle from the horizon h to the zenith z, the integral
// of 2 L sin cos over the angle is (h + z) / 2.
TEST(SkinDome, AGradientLightsGroundAsItsIntegralSays)
{
    const auto ground = tracerOf(skinMesh(squareMesh(Vec3d(0.0), Vec3d(0, 1, 0), 4)));
    Camera above = fromFront(2);
    above.eye = {0.001, 5, 0.002};
    above.target = {0.001, 0, 0.002};
    above.up = {0, 0, -1};
    RenderParams params = underDome(0, Scattering::single);
    params.dome.kind = DomeKind::gradient;
    params.dome.zenith = Vec3d(3);
    params.dome.horizon = Vec3d(1);
    params.dome.ground = Vec3d(100);
    const Figures figures(show(*ground, params, above), 0.8 * 2);
    EXPECT_NEAR(figures.mean / 1.6, 1, 0.002);
    EXPECT_LT(figures.rms, 0.02 * 1.6) << "noise of 128 directions a pixel";
}

TEST(SkinDome, UnderAPlateGroundLosesTheFormFactor)
{
    for (const double h : {0.5, 1.0, 3.0}) {
        const auto skins = tracerOf(squareMesh(Vec3d(0.0), Vec3d(0, 0, 1), 400), wallMaterial(1),
                                    squareMesh(Vec3d(0, 0, h), Vec3d(0, 0, 1), 2), wallMaterial(0));
        const double expected = 1 - formFactor(2, h);
        for (const Scattering scattering : kBoth) { // a black plate sends nothing back
            const Figures figures(
                show(*skins, underDome(1, scattering, 16), fromFront(0.01, h / 2)), expected);
            EXPECT_NEAR(figures.mean, expected, 0.004);
            EXPECT_LT(figures.rms, 0.03);
        }
    }
    EXPECT_NEAR(formFactor(2, 1), 0.5541, 1e-3) << "B-4 with A = B = 1: 4 x 0.1385";
}

// Between a white ground and a white plate as large as it, light is lost at the borders alone; of a
// grey plate the first bounce is known: what the plate's lower side gets.
TEST(SkinDome, InTheWhiteFurnaceAllIsOne)
{
    const auto plates = tracerOf(squareMesh(Vec3d(0.0), Vec3d(0, 0, 1), 400), wallMaterial(1),
                                 squareMesh(Vec3d(0, 0, 0.5), Vec3d(0, 0, 1), 2), wallMaterial(1));
    const Figures under(show(*plates, underDome(1, Scattering::multiple, 16), fromFront(1, 0.2)),
                        1);
    EXPECT_NEAR(under.mean, 1, 1e-3);
    const auto ball = tracerOf(ballMesh(Vec3d(0, 1, 0), 1, 24), wallMaterial(1),
                               squareMesh(Vec3d(0.0), Vec3d(0, 1, 0), 400), wallMaterial(1));
    Camera camera = fromFront(2.5);
    camera.eye = {0, 4, 8};
    camera.target = {0, 0.8, 0};
    const Figures all(show(*ball, underDome(1, Scattering::multiple, 24), camera), 1);
    EXPECT_NEAR(all.mean, 1, 1e-3);
    EXPECT_LT(all.rms, 0.01);
    // Black where it is dark: without bounces the same is below 1.
    EXPECT_LT(Figures(show(*ball, underDome(1, Scattering::single, 24), camera), 1).mean, 0.97);
}

// What a leaf shows of a sky before and one behind it, and of a light behind it.
TEST(SkinDome, ALeafLetsTheLightOfTheOtherSideThrough)
{
    Material leaf = wallMaterial(0.5);
    leaf.transmission = Vec3d(0.3);
    const auto skins = tracerOf(skinMesh(squareMesh(Vec3d(0.0), Vec3d(0, 1, 0), 4), leaf));
    Camera above = fromFront(2);
    above.eye = {0.001, 5, 0.002};
    above.target = {0.001, 0, 0.002};
    above.up = {0, 0, -1};
    RenderParams params = underDome(0, Scattering::multiple);
    params.dome.kind = DomeKind::gradient;
    params.dome.zenith = params.dome.horizon = Vec3d(1);
    params.dome.ground = Vec3d(0.25);
    EXPECT_LT(Figures(show(*skins, params, above), 0.575).rms, 1e-6);
    Light light;
    light.direction = {0, 1, 0};
    params.dome = {};
    for (const Shadows shadows : {Shadows::exact, Shadows::sweep}) {
        params.shadows = shadows;
        const Image image =
            render(emptyVolume(), {}, above, {light}, params, {}, nullptr, skins.get());
        EXPECT_LT(Figures(image, 0.3).rms, 1e-6);
    }
}

// A slab of fog of the optical depth d over a wall lets 2 E3(d) of an even sky through.
TEST(SkinDome, FogKeepsItsLightAway)
{
    const double depth = 0.5;
    Volume fog = emptyVolume(1.0 / 8);
    fog.parts[0].density->fill(openvdb::CoordBBox({-160, -160, 4}, {159, 159, 11}), float(depth),
                               true);
    const auto wall =
        tracerOf(skinMesh(squareMesh(Vec3d(0.0), Vec3d(0, 0, 1), 40), wallMaterial(1)));
    double expected = 0; // 2 E3
    for (int i = 0; i < 10000; ++i) {
        const double mu = (i + 0.5) / 10000;
        expected += 2 * mu * std::exp(-depth / mu) / 10000;
    }
    Material black;
    black.alpha = 0;
    for (const Scattering scattering : kBoth) {
        const Image image = render(fog, {black}, fromFront(0.5, 0.2), {},
                                   underDome(1, scattering, 16), {}, nullptr, wall.get());
        EXPECT_NEAR(Figures(image, expected).mean, expected, 0.006);
    }
}

// White fibres, leaves and fog on a white wall, seen from below them: all light comes through in
// the end.
TEST(SkinDome, InTheWhiteFurnaceAWallUnderFurIsOne)
{
    const auto wall =
        tracerOf(skinMesh(squareMesh(Vec3d(0.0), Vec3d(0, 0, 1), 40), wallMaterial(1)));
    for (const MaterialKind kind : {MaterialKind::fibre, MaterialKind::surface})
        for (const bool directed : {false, true}) {
            Volume volume = emptyVolume(1.0 / 8);
            VolumePart& part = volume.parts[0];
            part.kind = kind;
            const openvdb::CoordBBox box({-160, -160, 4}, {159, 159, 11});
            part.density->fill(box, 2.0f, true);
            if (directed) {
                part.direction = openvdb::Vec3SGrid::create();
                part.direction->setTransform(part.density->transformPtr());
                part.direction->fill(box, openvdb::Vec3s(0.6f, 0, 0.7f), true); // a spread, too
            }
            Material white;
            white.kind = kind;
            white.alpha = kind == MaterialKind::fibre ? 1 : 0.6;
            if (kind == MaterialKind::surface) white.transmission = Vec3d(0.4);
            const Image image = render(volume, {white}, fromFront(0.5, 0.2), {},
                                       underDome(1, Scattering::multiple), {}, nullptr, wall.get());
            EXPECT_NEAR(Figures(image, 1).mean, 1, 1e-3);
        }
}

// The same pixels for any number of threads and in any part of the picture.
TEST(SkinDome, NothingDependsOnThreadsOrTiles)
{
    const auto skins = tracerOf(ballMesh(Vec3d(0.0), 0.8, 12), wallMaterial(0.9),
                                squareMesh(Vec3d(0, -1, 0), Vec3d(0, 1, 0), 8), wallMaterial(0.7));
    RenderParams params = underDome(1, Scattering::multiple, 40, 3);
    Image whole, one;
    whole = show(*skins, params, fromFront(3));
    {
        const ThreadLimit limit(1);
        one = show(*skins, params, fromFront(3));
    }
    EXPECT_EQ(whole.pixels, one.pixels);
    params.crop = {7, 9, 20, 24};
    const Image part = show(*skins, params, fromFront(3));
    for (int y = 0; y < 24; ++y)
        for (int x = 0; x < 20; ++x)
            for (int c = 0; c < 4; ++c)
                ASSERT_EQ(part.pixel(x, y)[c], whole.pixel(x + 7, y + 9)[c]);
}

} // namespace volcomp
