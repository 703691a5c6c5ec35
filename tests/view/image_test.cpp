// SPDX-License-Identifier: Apache-2.0
// Pictures written and read back: PNG against the formulas of sRGB, EXR bit by bit.
#include "volcomp/view/image.h"

#include <cmath>
#include <limits>

#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"
#include "volcomp/base/error.h"
#include "volcomp/base/random.h"
#include "volcomp/base/srgb.h"

using namespace volcomp;

namespace {

Image image(int width, int height, const std::vector<std::string>& channels,
            const std::vector<float>& pixels)
{
    Image result;
    result.width = width;
    result.height = height;
    result.channels = channels;
    result.pixels = pixels;
    return result;
}

/// The bytes of a file as it stores them, without OpenImageIO's multiplication by alpha.
std::vector<int> storedBytes(const std::filesystem::path& file)
{
    OIIO::ImageSpec config;
    config.attribute("oiio:UnassociatedAlpha", 1);
    const auto in = OIIO::ImageInput::open(file.string(), &config);
    EXPECT_TRUE(in) << file;
    std::vector<unsigned char> bytes(in->spec().image_pixels() * in->spec().nchannels);
    EXPECT_TRUE(in->read_image(0, 0, 0, -1, OIIO::TypeDesc::UINT8, bytes.data()));
    return {bytes.begin(), bytes.end()};
}

} // namespace

// IEC 61966-2-1: 0.5 is 187.5 / 255 of the sRGB scale, 0.18 is 117.6, 0.002 lies on the straight
// part: 12.92 * 0.002 * 255 = 6.6.
TEST(Image, PngIsInSrgb)
{
    const TemporaryFolder folder;
    const float nan = std::numeric_limits<float>::quiet_NaN();
    writeImage(folder / "a.png",
               image(2, 2, {"R", "G", "B", "A"},
                     {0.5f, 0.18f, 0.002f, 1, 0, 1, 7, 1, -1, nan, 0.5f, 1, 0.5f, 0.5f, 0.5f, 1}));
    EXPECT_EQ(storedBytes(folder / "a.png"),
              (std::vector<int>{188, 118, 7, 0, 255, 255, 0, 0, 188, 188, 188, 188}))
        << "an opaque picture has no alpha; values are clamped, NaN is black";
}

TEST(Image, PngColoursAreNotMultipliedByAlpha)
{
    const TemporaryFolder folder;
    writeImage(folder / "a.png",
               image(3, 1, {"A", "B", "G", "R"}, // in any order
                     {0.5f, 0, 0.09f, 0.25f, 0, 0, 0, 0, 2, 1, 1, 1}));
    EXPECT_EQ(storedBytes(folder / "a.png"),
              (std::vector<int>{188, 118, 0, 128, 0, 0, 0, 0, 255, 255, 255, 255}))
        << "0.25 at alpha 0.5 is 0.5; nothing at alpha 0; alpha is linear and clamped";
    const Image back = readImage(folder / "a.png");
    ASSERT_EQ(back.channels, (std::vector<std::string>{"R", "G", "B", "A"}));
    EXPECT_NEAR(back.pixel(0, 0)[3], 128 / 255.0, 1e-6);
    EXPECT_NEAR(back.pixel(2, 0)[0], 1, 1e-6);
}

// Colours are looked at as they are without alpha; EXR and alpha stay as they are.
TEST(Image, ALookChangesPngAlone)
{
    const TemporaryFolder folder;
    const Image linear = image(2, 1, {"R", "G", "B", "A"}, {0.09f, 0.25f, 0, 0.5f, 0.18f, 1, 4, 1});
    const auto byte = [](double x) { return int(std::lround(255 * srgbFromLinear(float(x)))); };
    writeImage(folder / "a.png", linear, {}, {0, Tone::filmic});
    EXPECT_EQ(storedBytes(folder / "a.png"),
              (std::vector<int>{118, byte(filmic(0.5)), 0, 128, 118, byte(filmic(1)), 255, 255}));
    writeImage(folder / "b.png", linear, {}, {1, Tone::none});
    EXPECT_EQ(storedBytes(folder / "b.png"),
              (std::vector<int>{byte(0.36), 255, 0, 128, byte(0.36), 255, 255, 255}));
    writeImage(folder / "c.exr", linear, {}, {3, Tone::filmic});
    EXPECT_EQ(readImage(folder / "c.exr").pixels, linear.pixels);
}

TEST(Image, PngTakesTheChannelsThatItKnows)
{
    const TemporaryFolder folder;
    writeImage(folder / "a.png", image(1, 1, {"Z", "G", "albedo.R"}, {5, 0.5f, 1}));
    EXPECT_EQ(storedBytes(folder / "a.png"), (std::vector<int>{0, 188, 0}));
}

TEST(Image, ExrKeepsAllChannelsExactly)
{
    const TemporaryFolder folder;
    Random random(1);
    Image written =
        image(7, 5, {"R", "G", "B", "A", "Z", "N.X", "N.Y", "N.Z", "sun.R", "sun.G", "sun.B"}, {});
    for (int i = 0; i < 7 * 5 * 11; ++i)
        written.pixels.push_back(
            static_cast<float>(random.symmetric() * std::pow(10, 20 * random.symmetric())));
    written.pixel(3, 2)[4] = std::numeric_limits<float>::infinity();
    writeImage(folder / "a.exr", written,
               {{"volcomp:scene", "a \"scene\""}, {"volcomp:seed", "7"}});
    const Image back = readImage(folder / "a.exr");
    EXPECT_EQ(back.width, 7);
    EXPECT_EQ(back.height, 5);
    ASSERT_EQ(back.channels.size(), written.channels.size());
    for (std::size_t c = 0; c < written.channels.size(); ++c) { // the file may sort them
        const auto at = std::find(back.channels.begin(), back.channels.end(), written.channels[c]);
        ASSERT_NE(at, back.channels.end()) << written.channels[c];
        for (int y = 0; y < 5; ++y)
            for (int x = 0; x < 7; ++x)
                EXPECT_EQ(back.pixel(x, y)[at - back.channels.begin()], written.pixel(x, y)[c]);
    }
    const auto in = OIIO::ImageInput::open((folder / "a.exr").string());
    ASSERT_TRUE(in);
    EXPECT_EQ(in->spec().get_string_attribute("volcomp:scene"), "a \"scene\"");
    EXPECT_EQ(in->spec().get_string_attribute("volcomp:seed"), "7");
    EXPECT_EQ(in->spec().format, OIIO::TypeDesc::FLOAT);
}

TEST(Image, IsItsDisplayWindow)
{
    const TemporaryFolder folder;
    const auto file = folder / "a.exr";
    OIIO::ImageSpec spec(2, 1, 1, OIIO::TypeDesc::FLOAT);
    spec.x = 1, spec.y = 2, spec.full_x = 0, spec.full_y = 0;
    const auto write = [&](int size) {
        spec.full_width = spec.full_height = size;
        const float pixels[2] = {3, 4};
        const auto out = OIIO::ImageOutput::create(file.string());
        EXPECT_TRUE(out->open(file.string(), spec)
                    && out->write_image(OIIO::TypeDesc::FLOAT, pixels) && out->close());
    };
    write(4);
    const Image back = readImage(file);
    EXPECT_EQ(back.pixels, (std::vector<float>{0, 0, 0, 0, 0, 0, 0, 0, 0, 3, 4, 0, 0, 0, 0, 0}));
    write(1 << 20); // 4 TB of nothing
    EXPECT_THROW(readImage(file), Error);
}

// OpenImageIO's create() takes what follows a question mark for a query.
TEST(Image, NamesMayHaveAnyCharacters)
{
    const TemporaryFolder folder;
    for (const std::string name : {"a?b=c", "a*[b]", "a\nb", "a b$(c);d", "%d#"})
        for (const char* ending : {".png", ".exr"}) {
            writeImage(folder / (name + ending), image(1, 1, {"R", "G", "B"}, {1, 1, 1}));
            EXPECT_EQ(readImage(folder / (name + ending)).pixels, (std::vector<float>{1, 1, 1}))
                << name << ending;
        }
}

TEST(Image, SaysWhatCannotBeWrittenOrRead)
{
    const TemporaryFolder folder;
    const Image black = image(1, 1, {"R", "G", "B"}, {0, 0, 0});
    EXPECT_THROW(writeImage(folder / "a.jpg", black), Error);
    EXPECT_THROW(writeImage(folder / "a", black), Error);
    EXPECT_TRUE(requirePictureName("a.EXR"));
    EXPECT_FALSE(requirePictureName("b/a.Png"));
    EXPECT_THROW(readImage(folder / "none.exr"), Error);
    EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(Srgb, BothWaysAgreeAndMeetAtTheKnee)
{
    for (int i = 0; i <= 1000; ++i) {
        const double c = i / 1000.0;
        EXPECT_NEAR(srgbFromLinear(linearFromSrgb(c)), c, 2e-7) << "the two knees differ by 1e-7";
        EXPECT_NEAR(linearFromSrgb(float(c)), linearFromSrgb(c), 1e-6);
    }
    EXPECT_NEAR(linearFromSrgb(0.5), 0.21404114, 1e-8); // pow((0.5 + 0.055) / 1.055, 2.4)
    EXPECT_NEAR(srgbFromLinear(0.18), 0.46135613, 1e-8);
    EXPECT_EQ(srgbFromLinear(-1.0), 0);
    EXPECT_DOUBLE_EQ(srgbFromLinear(5.0), 1);
}
