// SPDX-License-Identifier: Apache-2.0
// Domes: where an image's texels lie in the sky, what images are refused, and suns.
#include "volcomp/view/dome.h"

#include <cmath>
#include <functional>
#include <limits>

#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"
#include "volcomp/base/random.h"
#include "volcomp/base/srgb.h"
#include "volcomp/view/image.h"

using namespace volcomp;

namespace {

/// An image of a dome whose texels are colour(x, y).
Image panorama(int height, const std::function<Vec3d(int, int)>& colour)
{
    Image image;
    image.width = 2 * height;
    image.height = height;
    image.channels = {"R", "G", "B"};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < 2 * height; ++x)
            for (int c = 0; c < 3; ++c) image.pixels.push_back(float(colour(x, y)[c]));
    return image;
}

Dome domeOf(const std::filesystem::path& file)
{
    Dome dome;
    dome.kind = DomeKind::image;
    dome.file = file;
    return dome;
}

/// A loaded dome of an image.
Dome loaded(const TemporaryFolder& folder, const Image& image, std::vector<Light>* suns = nullptr)
{
    writeImage(folder / "sky.exr", image);
    Dome dome = domeOf(folder / "sky.exr");
    const std::vector<Light> lights = loadDome(dome);
    if (suns) *suns = lights;
    return dome;
}

Vec3d direction(double up_degrees, double around_degrees)
{
    const double up = up_degrees * kDegree, around = around_degrees * kDegree;
    return {std::cos(up) * std::sin(around), std::sin(up), -std::cos(up) * std::cos(around)};
}

/// The mean over all directions, by rows of equal solid angle.
Vec3d meanOf(const std::function<Vec3d(const Vec3d&)>& radiance, int rows)
{
    Vec3d sum(0.0);
    for (int j = 0; j < rows; ++j)
        for (int i = 0; i < 2 * rows; ++i)
            sum += radiance(
                direction(std::asin(2 * (j + 0.5) / rows - 1) / kDegree, 180 * (i + 0.5) / rows));
    return sum / (2.0 * rows * rows);
}

double angleBetween(const Vec3d& a, const Vec3d& b) { return std::acos(std::min(1.0, a.dot(b))); }

void expectNear(const Vec3d& a, const Vec3d& b, double tolerance)
{
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(a[c], b[c], tolerance) << a << " and " << b;
}

} // namespace

TEST(Dome, ConstantAndGradient)
{
    Dome dome;
    EXPECT_TRUE(dome.black());
    dome.colour = Vec3d(1, 2, 3);
    dome.strength = 2;
    EXPECT_FALSE(dome.black());
    expectNear(dome.radiance(direction(-30, 20)), Vec3d(2, 4, 6), 1e-12);
    dome.kind = DomeKind::gradient;
    EXPECT_TRUE(dome.black());
    dome.zenith = Vec3d(1);
    dome.horizon = Vec3d(0.5);
    dome.ground = Vec3d(0.1);
    expectNear(dome.radiance(direction(90, 0)), Vec3d(2), 1e-12);
    expectNear(dome.radiance(direction(45, 77)), Vec3d(1.5), 1e-12);
    expectNear(dome.seen(direction(-1, 77)), Vec3d(0.2), 1e-12);
    dome.strength = 0;
    EXPECT_TRUE(dome.black());
    EXPECT_TRUE(loadDome(dome).empty());
}

// The middle of the image looks along -z, its right half towards +x, so u = 0 looks along +z.
TEST(Dome, TexelsLieWhereTheyShould)
{
    const TemporaryFolder folder;
    const int height = 8;
    Dome dome =
        loaded(folder, panorama(height, [](int x, int y) { return Vec3d(x + 1, y + 1, 1); }));
    EXPECT_FALSE(dome.black());
    const double texel = 180.0 / height;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < 2 * height; ++x)
            expectNear(dome.radiance(direction(90 - (y + 0.5) * texel, (x + 0.5) * texel - 180)),
                       Vec3d(x + 1, y + 1, 1), 1e-5);
    // Between two texels it is linear; across u = 0 the last and the first are neighbours.
    expectNear(dome.radiance(Vec3d(0, 0, -1)), Vec3d(8.5, 4.5, 1), 1e-5);
    expectNear(dome.radiance(Vec3d(1, 0, 0)), Vec3d(12.5, 4.5, 1), 1e-5);
    expectNear(dome.radiance(Vec3d(0, 0, 1)), Vec3d(8.5, 4.5, 1), 1e-5);
    expectNear(dome.radiance(direction(0, 180 - 0.25 * texel)), Vec3d(12.25, 4.5, 1), 1e-5);
    // At the poles the first and the last row go on.
    EXPECT_NEAR(dome.radiance(Vec3d(0, 1, 0))[1], 1, 1e-5);
    EXPECT_NEAR(dome.radiance(Vec3d(0, -1, 0))[1], height, 1e-5);
    // Turned by 90 degrees, the middle looks along +x.
    dome.rotate = 90 * kDegree;
    dome.strength = 2;
    expectNear(dome.radiance(Vec3d(1, 0, 0)), 2.0 * Vec3d(8.5, 4.5, 1), 1e-5);
    expectNear(dome.radiance(Vec3d(0, 0, 1)), 2.0 * Vec3d(12.5, 4.5, 1), 1e-5);
}

TEST(Dome, ImagesOfAllKindsAreLinear)
{
    const TemporaryFolder folder;
    writeImage(folder / "sky.png", panorama(4, [](int x, int) { return Vec3d(0.1 * x, 0.5, 0); }));
    Dome dome = domeOf(folder / "sky.png");
    loadDome(dome);
    expectNear(dome.radiance(direction(22.5, -180 + 2.5 * 45)), Vec3d(0.2, 0.5, 0), 0.003);

    Image grey = panorama(4, [](int, int) { return Vec3d(0.25); });
    grey.channels = {"Y"};
    grey.pixels.resize(grey.pixels.size() / 3);
    dome = loaded(folder, grey);
    expectNear(dome.radiance(direction(10, 10)), Vec3d(0.25), 1e-6);

    dome = loaded(folder, panorama(4, [](int, int) { return Vec3d(0.0); }));
    EXPECT_TRUE(dome.black());
}

TEST(Dome, OfImagesThatAreNoSkiesNamesFileAndPlace)
{
    const TemporaryFolder folder;
    const auto message = [&](const Image& image) {
        return messageOf([&] { loaded(folder, image); });
    };
    const auto with = [](int at_x, int at_y, double value) {
        return panorama(
            4, [=](int x, int y) { return Vec3d(1, x == at_x && y == at_y ? value : 1.0, 1); });
    };
    const std::string file = (folder / "sky.exr").string();
    Image square = with(0, 0, 1);
    square.width = square.height = 4;
    square.pixels.resize(48);
    EXPECT_EQ(message(square),
              file
                  + ": expected an image all around, twice as wide as high, found 4 x 4 pixels. "
                    "Save it as a lat-long (equirectangular) panorama.");
    EXPECT_EQ(message(with(5, 2, std::numeric_limits<double>::quiet_NaN())),
              file
                  + ": pixel (5, 2): expected finite values >= 0, found NaN. Mend it in a program "
                    "for pictures.");
    EXPECT_NE(message(with(7, 3, std::numeric_limits<double>::infinity())).find("infinity"),
              std::string::npos);
    EXPECT_NE(
        message(with(7, 3, -0.5)).find("pixel (7, 3): expected finite values >= 0, found -0.5"),
        std::string::npos);
    Image two = with(0, 0, 1);
    two.channels = {"R", "G"};
    two.pixels.resize(64);
    EXPECT_NE(message(two).find("expected one channel (grey) or red, green and blue, found 2"),
              std::string::npos);
    OIIO::ImageSpec spec(4, 2, 3, OIIO::TypeDesc::FLOAT);
    spec.full_width = 40000;
    spec.full_height = 20000;
    const auto out = OIIO::ImageOutput::create("exr");
    const std::vector<float> ones(24, 1.0f);
    ASSERT_TRUE(out->open((folder / "window.exr").string(), spec)
                && out->write_image(OIIO::TypeDesc::FLOAT, ones.data()) && out->close());
    Dome window = domeOf(folder / "window.exr");
    EXPECT_NE(messageOf([&] { loadDome(window); }).find("much larger than the data"),
              std::string::npos);
    Dome missing = domeOf(folder / "none.exr");
    EXPECT_NE(messageOf([&] { loadDome(missing); }).find("none.exr"), std::string::npos);
}

// A disc of 0.53 degrees in a sky of a gradient becomes a light; together they have the image's
// light, and what is seen is the image.
TEST(Dome, ASunBecomesALight)
{
    const TemporaryFolder folder;
    const int height = 1024;
    const double texel = 180.0 / height;
    const double radius = 0.265 * kDegree, radiance = 9e4;
    const Vec3d sun = direction(35.3, 61.7), colour(1, 0.9, 0.7);
    const auto sky = [&](const Vec3d& d) { return Vec3d(0.5 + 0.4 * d[1], 0.6, 0.8 + 0.1 * d[0]); };
    const Image image = panorama(height, [&](int x, int y) {
        const Vec3d middle = direction(90 - (y + 0.5) * texel, (x + 0.5) * texel - 180);
        if (angleBetween(middle, sun) > radius + 2 * texel * kDegree) return sky(middle);
        int hits = 0; // of 16 x 16 places in the texel
        for (int i = 0; i < 256; ++i)
            hits += angleBetween(direction(90 - (y + (i / 16 + 0.5) / 16) * texel,
                                           (x + (i % 16 + 0.5) / 16) * texel - 180),
                                 sun)
                < radius;
        return Vec3d(sky(middle) + hits / 256.0 * radiance * colour);
    });
    std::vector<Light> suns;
    Dome dome = loaded(folder, image, &suns);
    ASSERT_EQ(suns.size(), 1u);
    EXPECT_LT(angleBetween(-suns[0].direction, sun), 0.5 * texel * kDegree);
    EXPECT_NEAR(suns[0].disc, 2 * radius, 0.15 * 2 * radius);
    const double size = 2 * kPi * (1 - std::cos(radius));
    expectNear(kPi * suns[0].strength, size * radiance * colour, 0.01 * size * radiance);

    // The light of the image, texel by texel.
    Vec3d all(0.0);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < 2 * height; ++x)
            for (int c = 0; c < 3; ++c)
                all[c] += image.pixel(x, y)[c] * kPi / height
                    * (std::cos(kPi * y / height) - std::cos(kPi * (y + 1) / height));
    const auto light = [&](const Vec3d& rest) { return 4 * kPi * rest + kPi * suns[0].strength; };
    for (int c = 0; c < 3; ++c) {
        const auto fine = meanOf([&](const Vec3d& d) { return dome.radiance(d); }, 1000);
        const auto soft = meanOf([&](const Vec3d& d) { return dome.softRadiance(d); }, 200);
        EXPECT_NEAR(light(fine)[c] / all[c], 1, 0.001);
        EXPECT_NEAR(light(soft)[c] / all[c], 1, 0.001);
    }
    // What lights has no sun, what is seen has it.
    expectNear(dome.radiance(sun), sky(sun), 0.01);
    EXPECT_NEAR(dome.seen(sun)[0] / radiance, 1, 0.01);
    expectNear(dome.seen(direction(-20, 10)), sky(direction(-20, 10)), 0.01);

    // It turns with the image and shines as strongly as it.
    dome.rotate = 30 * kDegree;
    dome.strength = 0.5;
    const std::vector<Light> turned = loadDome(dome);
    ASSERT_EQ(turned.size(), 1u);
    EXPECT_LT(angleBetween(-turned[0].direction, direction(35.3, 91.7)), 0.5 * texel * kDegree);
    expectNear(turned[0].strength, 0.5 * suns[0].strength, 1e-9 * radiance);
    expectNear(dome.radiance(direction(35.3, 91.7)), 0.5 * sky(sun), 0.01);
    EXPECT_NEAR(dome.seen(direction(35.3, 91.7))[0] / radiance, 0.5, 0.01);
}

TEST(Dome, ASkyWithoutASunHasNone)
{
    const TemporaryFolder folder;
    const int height = 180;
    const auto sunsOf = [&](const std::function<double(const Vec3d&)>& value) {
        std::vector<Light> suns;
        loaded(folder,
               panorama(height,
                        [&](int x, int y) { return Vec3d(value(direction(89.5 - y, x - 179.5))); }),
               &suns);
        return suns.size();
    };
    const Vec3d place = direction(30, -179.5);
    const auto glow = [&](const Vec3d& d) {
        return 1 + 60 * std::exp(-angleBetween(d, place) / 0.1);
    };
    EXPECT_EQ(sunsOf(glow), 0u) << "the wide glow of a veiled sun";
    EXPECT_EQ(
        sunsOf([&](const Vec3d& d) { return angleBetween(d, place) < 8 * kDegree ? 200 : 1; }), 0u)
        << "a window";
    Random random(7);
    EXPECT_EQ(sunsOf([&](const Vec3d&) { return random.uniform() < 0.001 ? 1000 : 1; }), 0u)
        << "stars";
    // Two suns, one of them in two texels at the seam, with a glow around them.
    EXPECT_EQ(sunsOf([&](const Vec3d& d) {
                  const bool here = angleBetween(d, place) < 0.8 * kDegree,
                             there = angleBetween(d, direction(60, 20)) < 1 * kDegree;
                  return glow(d) + (here || there ? 5e4 : 0);
              }),
              2u);
}
