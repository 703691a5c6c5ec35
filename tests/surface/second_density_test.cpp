// SPDX-License-Identifier: Apache-2.0
#include "volcomp/surface/second_density.h"

#include <cmath>
#include <cstring>
#include <fstream>
#include <functional>

#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include "volcomp/base/error.h"
#include "volcomp/base/random.h"
#include "volcomp/surface/texture.h"
#include "volcomp/view/image.h"

namespace volcomp {
namespace {

/// Writes a small PGM, PPM or PFM; OpenImageIO reads all three.
std::filesystem::path write(const std::string& name, const std::string& bytes)
{
    const std::filesystem::path file =
        std::filesystem::path(::testing::TempDir()) / ("volcomp_map_" + name);
    std::ofstream(file, std::ios::binary) << bytes;
    return file;
}

std::filesystem::path floats(const std::string& name, int width, int height,
                             const std::vector<float>& values)
{
    std::string bytes = "Pf\n" + std::to_string(width) + " " + std::to_string(height)
        + "\n-1.0\n"; // its rows run from the bottom
    bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * 4);
    return write(name, bytes);
}

MapFactor image(const std::filesystem::path& file)
{
    MapFactor m;
    m.image = file;
    return m;
}

TEST(Texture, eightAndSixteenBitsAndFloats)
{
    EXPECT_NEAR(readTexture(write("8.pgm", "P2\n1 1\n255\n51\n"), false).pixels[0], 0.2, 1e-6);
    EXPECT_NEAR(readTexture(write("16.pgm", "P2\n1 1\n65535\n13107\n"), false).pixels[0], 0.2,
                1e-6);
    EXPECT_FLOAT_EQ(readTexture(floats("32.pfm", 1, 1, {-3.5f}), false).pixels[0], -3.5f);
    EXPECT_NEAR(readTexture(write("8.pgm", "P2\n1 1\n255\n188\n"), true).pixels[0], 0.5029,
                1e-3); // by the sRGB curve
}

TEST(Texture, rowsRunDownwardsAndWrapModes)
{
    const Texture t = readTexture(write("rows.pgm", "P2\n2 2\n255\n0 255\n51 102\n"),
                                  false); // top: 0 1, bottom: 0.2 0.4
    EXPECT_NEAR(t.sample(0.25, 0.75, 0, Wrap::clamp), 0, 1e-6);
    EXPECT_NEAR(t.sample(0.75, 0.75, 0, Wrap::clamp), 1, 1e-6);
    EXPECT_NEAR(t.sample(0.25, 0.25, 0, Wrap::clamp), 0.2, 1e-6);
    EXPECT_NEAR(t.sample(0.5, 0.5, 0, Wrap::clamp), 0.4, 1e-6);
    EXPECT_NEAR(t.sample(1.25, 0.75, 0, Wrap::repeat), 0, 1e-6);
    EXPECT_NEAR(t.sample(1.25, 0.75, 0, Wrap::mirror), 1, 1e-6);
    EXPECT_NEAR(t.sample(-7, 0.75, 0, Wrap::clamp), 0, 1e-6);
    EXPECT_NEAR(t.sample(1.5, 0.75, 0, Wrap::black), 0, 1e-6);
    EXPECT_NEAR(t.sample(1, 0.75, 0, Wrap::repeat), 0.5, 1e-6); // at the seam
    EXPECT_EQ(t.sample(NAN, 0.5, 0, Wrap::repeat), 0);
    EXPECT_EQ(t.sample(1e300, 0.5, 0, Wrap::repeat), 0);
}

TEST(Texture, wrongFilesAreRefusedWithTheirName)
{
    const auto refuses = [&](const std::filesystem::path& file) {
        try {
            readTexture(file, false);
        } catch (const Error& e) {
            return std::string(e.what()).find(file.filename().string()) != std::string::npos;
        }
        return false;
    };
    EXPECT_TRUE(refuses("/nonexistent/map.png"));
    EXPECT_TRUE(refuses(write("empty.png", "")));
    EXPECT_TRUE(refuses(write("text.png", "no picture at all")));
    EXPECT_TRUE(refuses(write("cut.ppm", "P6\n100 100\n255\nxyz")));
    EXPECT_TRUE(refuses(floats("nan.pfm", 2, 1, {1.0f, NAN})));
}

/// Writes an EXR or PNG of three channels whose pixels are what `value` says of their places.
std::filesystem::path byOpenImageIO(const std::string& name, OIIO::ImageSpec spec,
                                    const std::function<float(int, int)>& value)
{
    const std::filesystem::path file =
        std::filesystem::path(::testing::TempDir()) / ("volcomp_map_" + name);
    std::vector<float> pixels;
    for (int y = 0; y < spec.height; ++y)
        for (int x = 0; x < spec.width; ++x)
            pixels.insert(pixels.end(), 3, value(spec.x + x, spec.y + y));
    const auto out = OIIO::ImageOutput::create(file.string());
    EXPECT_TRUE(out && out->open(file.string(), spec)
                && out->write_image(OIIO::TypeDesc::FLOAT, pixels.data()) && out->close());
    return file;
}

// A picture of 8 x 6 pixels that is white only in its lower right quarter, whole, trimmed to that
// quarter, and with data around it that nobody should see.
TEST(Texture, theDisplayWindowFillsTheUnitSquare)
{
    const auto value = [](int x, int y) {
        const bool inside = x >= 0 && x < 8 && y >= 0 && y < 6;
        return !inside ? 7.0f : x >= 4 && y >= 3 ? 1.0f + float(x) / 8 : 0.0f;
    };
    const auto spec = [](int x, int y, int width, int height) {
        OIIO::ImageSpec s(width, height, 3, OIIO::TypeDesc::FLOAT);
        s.x = x, s.y = y, s.full_x = s.full_y = 0, s.full_width = 8, s.full_height = 6;
        return s;
    };
    const Texture whole = readTexture(byOpenImageIO("w.exr", spec(0, 0, 8, 6), value), true);
    for (const Texture& other :
         {readTexture(byOpenImageIO("t.exr", spec(4, 3, 4, 3), value), true),
          readTexture(byOpenImageIO("o.exr", spec(-3, -2, 20, 11), value), true)}) {
        EXPECT_EQ(other.width, 8);
        EXPECT_EQ(other.height, 6);
        for (const Wrap wrap : {Wrap::repeat, Wrap::clamp, Wrap::mirror, Wrap::black})
            for (double u = -1.3; u < 2.3; u += 0.07)
                for (double v = -1.3; v < 2.3; v += 0.07) {
                    ASSERT_EQ(other.sample(u, v, 1, wrap), whole.sample(u, v, 1, wrap));
                    ASSERT_EQ(other.colour(u, v, wrap), whole.colour(u, v, wrap));
                }
    }
}

// 0.5 is 0.2140 of sRGB's scale (IEC 61966-2-1) and 0.5^1.8 = 0.2872.
TEST(Texture, coloursAreConvertedAsTheirFileSaysAndDataNever)
{
    struct Case {
        const char *name, *space;
        OIIO::TypeDesc type;
        double linear;
    };
    const auto u8 = OIIO::TypeDesc::UINT8, u16 = OIIO::TypeDesc::UINT16;
    for (const auto& [name, space, type, linear] :
         {Case{"c.png", "sRGB", u8, 0.2140}, Case{"c.png", "sRGB", u16, 0.2140},
          Case{"c.png", "", u8, 0.2140}, Case{"c.png", "", u16, 0.2140},
          Case{"c.png", "Gamma1.8", u8, 0.2872}, Case{"c.png", "Gamma1.8", u16, 0.2872},
          Case{"c.png", "Linear", u8, 0.5}, Case{"c.png", "Linear", u16, 0.5},
          Case{"c.tif", "", u8, 0.2140}, Case{"c.tif", "", u16, 0.2140},
          Case{"c.tif", "", OIIO::TypeDesc::FLOAT, 0.5}, Case{"c.jpg", "", u8, 0.2140},
          Case{"c.exr", "", OIIO::TypeDesc::HALF, 0.5},
          Case{"c.hdr", "", OIIO::TypeDesc::FLOAT, 0.5}}) {
        OIIO::ImageSpec spec(16, 16, 3, type);
        if (*space) spec.attribute("oiio:ColorSpace", space);
        const auto file = byOpenImageIO(name, spec, [](int, int) { return 0.5f; });
        const double rounding = type == u8 ? 0.005 : 2e-4;
        EXPECT_NEAR(readTexture(file, true).pixels[0], linear, rounding) << name << ' ' << space;
        EXPECT_NEAR(readTexture(file, false).pixels[0], 0.5, rounding) << name << ' ' << space;
    }
}

TEST(SecondDensity, factorsMultiplyAndRangesInvert)
{
    MapFactor half;
    half.constant = Vec3d(0.5);
    MapFactor grey = image(write("grey.pgm", "P2\n1 1\n255\n51\n"));
    grey.low = 1;
    grey.high = 0;
    const SecondDensity m({half, grey}, false);
    EXPECT_NEAR(m.value({0.3, 0.3}, Vec3d(0.0)), 0.4, 1e-6);
    EXPECT_FALSE(m.isConstant());
    EXPECT_TRUE(m.usesUv());
    EXPECT_EQ(SecondDensity({}, false).value({0, 0}, Vec3d(0.0)), 1);
    EXPECT_TRUE(SecondDensity({half}, false).isConstant());
}

TEST(SecondDensity, channelsAndLuminance)
{
    const auto file = write("rgb.ppm", "P3\n1 1\n255\n255 51 0\n");
    MapFactor m = image(file);
    EXPECT_NEAR(SecondDensity({m}, false).value({0.5, 0.5}, Vec3d(0.0)), 0.2126 + 0.7152 * 0.2,
                1e-5);
    m.channel = 1;
    EXPECT_NEAR(SecondDensity({m}, false).value({0.5, 0.5}, Vec3d(0.0)), 0.2, 1e-6);
    m.channel = 3;
    EXPECT_THROW(SecondDensity({m}, false), Error);
    const Vec3f c = SecondDensity({image(file)}, true)
                        .colour({0.5, 0.5}, Vec3d(0.0)); // a colour map is converted from sRGB
    EXPECT_NEAR(c[0], 1, 1e-5);
    EXPECT_NEAR(c[1], 0.0331, 1e-3);
}

TEST(SecondDensity, alphasOfColoursMultiply)
{
    const auto withAlpha = [](const std::string& name, float alpha) {
        Image pixel{1, 1, {"R", "G", "B", "A"}, {0.5f * alpha, 0.5f * alpha, 0.5f * alpha, alpha}};
        const auto file = std::filesystem::path(::testing::TempDir()) / ("volcomp_map_" + name);
        writeImage(file, pixel);
        return image(file);
    };
    MapFactor half = withAlpha("half.exr", 0.5f), opaque = withAlpha("opaque.exr", 1);
    const SecondDensity both({half, half, opaque}, true);
    EXPECT_TRUE(both.hasAlpha());
    EXPECT_FLOAT_EQ(both.alpha({0.5, 0.5}), 0.25f);
    EXPECT_FALSE(SecondDensity({opaque}, true).hasAlpha());
    EXPECT_FLOAT_EQ(SecondDensity({opaque}, true).alpha({0.5, 0.5}), 1);
    // Of data, and of a channel that is taken by itself, alpha is no outline.
    EXPECT_FALSE(SecondDensity({half}, false).hasAlpha());
    half.channel = 0;
    EXPECT_FALSE(SecondDensity({half}, true).hasAlpha());
    opaque.wrap = Wrap::black; // nothing is there outside of the unit square
    const SecondDensity alone({opaque}, true);
    EXPECT_TRUE(alone.hasAlpha());
    EXPECT_FLOAT_EQ(alone.alpha({0.5, 0.5}), 1);
    EXPECT_FLOAT_EQ(alone.alpha({1.6, 0.5}), 0);
}

TEST(SecondDensity, noiseIsSmoothEvenAndDependsOnItsSeed)
{
    MapFactor m;
    m.noise = 0.1;
    m.octaves = 3;
    const SecondDensity a({m}, false);
    m.seed = 2;
    const SecondDensity b({m}, false);
    double mean = 0, square = 0, product = 0, jump = 0;
    const int n = 20000;
    for (int k = 0; k < n; ++k) {
        Random r(hashKey(1, k));
        const Vec3d p(r.symmetric() * 10, r.symmetric() * 10, r.symmetric() * 10);
        const double x = a.value({0, 0}, p), y = b.value({0, 0}, p);
        EXPECT_TRUE(x >= 0 && x <= 1);
        mean += x / n;
        square += (x - 0.5) * (x - 0.5) / n;
        product += (x - 0.5) * (y - 0.5) / n;
        jump = std::max(jump, std::abs(x - a.value({0, 0}, p + Vec3d(1e-5, 0, 0))));
    }
    EXPECT_NEAR(mean, 0.5, 0.01);
    EXPECT_GT(std::sqrt(square), 0.08);
    EXPECT_LT(std::abs(product) / square, 0.05);
    EXPECT_LT(jump, 1e-3);
    EXPECT_EQ(gradientNoise({NAN, 0, 0}, 1, 1), 0.5);
    // Its finest octave lies at 3e19, beyond whole numbers of 64 bits.
    const double far_off = gradientNoise({9e14, 0.3, 0}, 16, 1);
    EXPECT_TRUE(far_off >= 0 && far_off <= 1);
}

} // namespace
} // namespace volcomp
