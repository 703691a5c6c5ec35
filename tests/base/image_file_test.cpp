// SPDX-License-Identifier: Apache-2.0
// Images of other programs: their windows, their colours, and files that are damaged or lie.
#include "volcomp/base/image_file.h"

#include <cmath>
#include <cstring>
#include <functional>

#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"
#include "volcomp/base/error.h"

namespace volcomp {
namespace {

struct Windows {
    int x = 0, y = 0, width = 0, height = 0;                     // of the data
    int full_x = 0, full_y = 0, full_width = 0, full_height = 0; // of the display; 0: the data's
};

using Setup = std::function<void(OIIO::ImageSpec&)>;

/// Writes an image whose values are what `value` says of a pixel's place by the file's own count.
void write(const std::filesystem::path& file, const Windows& w, int channels, OIIO::TypeDesc type,
           const std::function<float(int, int, int)>& value, const Setup& setup = {})
{
    OIIO::ImageSpec spec(w.width, w.height, channels, type);
    spec.x = w.x;
    spec.y = w.y;
    if (w.full_width > 0) {
        spec.full_x = w.full_x;
        spec.full_y = w.full_y;
        spec.full_width = w.full_width;
        spec.full_height = w.full_height;
    }
    if (setup) setup(spec);
    std::vector<float> pixels;
    for (int y = 0; y < w.height; ++y)
        for (int x = 0; x < w.width; ++x)
            for (int c = 0; c < channels; ++c) pixels.push_back(value(w.x + x, w.y + y, c));
    const auto out = OIIO::ImageOutput::create(file.string());
    ASSERT_TRUE(out) << file << OIIO::geterror();
    ASSERT_TRUE(out->open(file.string(), spec)) << out->geterror();
    ASSERT_TRUE(out->write_image(OIIO::TypeDesc::FLOAT, pixels.data())) << out->geterror();
    ASSERT_TRUE(out->close());
}

float placeValue(int x, int y, int c) { return float(1 + x + 100 * y) + float(c) / 4; }
float half(int, int, int) { return 0.5f; }

ImageFile read(const std::filesystem::path& file) { return readImageFile(file, StoredAlpha::keep); }

double peakMegabytes()
{
    rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    return double(usage.ru_maxrss) / 1024;
}

// Rows and columns of the display window count from its corner; what lies outside of it is gone.
TEST(ImageFile, dataAreCutByTheDisplayWindow)
{
    const TemporaryFolder folder;
    const auto name = folder / "a.exr";
    struct Case {
        Windows windows;
        PixelWindow data;
    };
    const Case cases[] = {
        {{0, 0, 7, 5}, {0, 0, 7, 5}},
        {{12, 21, 3, 2, 10, 20, 8, 6}, {2, 1, 3, 2}}, // trimmed
        {{-3, -2, 20, 30, 0, 0, 8, 6}, {0, 0, 8, 6}}, // overscan
        {{-5, 3, 9, 9, -2, -1, 8, 6}, {0, 4, 6, 2}},  // over one corner
        {{100, 100, 4, 4, 0, 0, 8, 6}, {0, 0, 0, 0}}, // apart
    };
    for (const int tile : {0, 16})
        for (const auto& [w, data] : cases) {
            write(name, w, 3, OIIO::TypeDesc::FLOAT, placeValue,
                  [&](OIIO::ImageSpec& spec) { spec.tile_width = spec.tile_height = tile; });
            const ImageFile image = read(name);
            EXPECT_EQ(image.width, w.full_width ? w.full_width : w.width);
            EXPECT_EQ(image.height, w.full_height ? w.full_height : w.height);
            EXPECT_EQ(image.data.x, data.x);
            EXPECT_EQ(image.data.y, data.y);
            EXPECT_EQ(image.data.width, data.width);
            EXPECT_EQ(image.data.height, data.height);
            ASSERT_EQ(image.pixels.size(), std::size_t(data.width) * data.height * 3);
            std::size_t i = 0;
            for (int y = 0; y < data.height; ++y)
                for (int x = 0; x < data.width; ++x)
                    for (int c = 0; c < 3; ++c)
                        ASSERT_EQ(image.pixels[i++],
                                  placeValue(w.full_x + data.x + x, w.full_y + data.y + y, c));
        }
}

TEST(ImageFile, aTiffMayHaveADisplayWindow)
{
    const TemporaryFolder folder;
    write(folder / "a.tif", {4, 2, 4, 4, 0, 0, 8, 6}, 1, OIIO::TypeDesc::FLOAT, placeValue);
    const ImageFile image = read(folder / "a.tif");
    EXPECT_EQ(image.width, 8);
    EXPECT_EQ(image.height, 6);
    EXPECT_EQ(image.data.x, 4);
    EXPECT_EQ(image.data.y, 2);
    EXPECT_EQ(image.pixels.at(0), placeValue(4, 2, 0));
}

// Large enough for several pieces of rows.
TEST(ImageFile, manyRowsArriveInTheirOrder)
{
    const TemporaryFolder folder;
    for (const char* name : {"a.exr", "a.tif"})
        for (const int tile : {0, 64}) {
            write(folder / name, {0, 0, 700, 900}, 2, OIIO::TypeDesc::FLOAT, placeValue,
                  [&](OIIO::ImageSpec& spec) { spec.tile_width = spec.tile_height = tile; });
            const ImageFile image = read(folder / name);
            ASSERT_EQ(image.pixels.size(), 700u * 900 * 2);
            for (int y = 0; y < 900; ++y)
                for (int x = 0; x < 700; ++x)
                    for (int c = 0; c < 2; ++c)
                        ASSERT_EQ(image.pixels[(std::size_t(y) * 700 + x) * 2 + c],
                                  placeValue(x, y, c))
                            << name;
        }
}

TEST(ImageFile, anOffsetOnAPageIsNoDisplayWindow)
{
    const TemporaryFolder folder;
    write(folder / "a.png", {0, 0, 4, 3}, 1, OIIO::TypeDesc::UINT8, half,
          [](OIIO::ImageSpec& spec) {
              spec.x = spec.full_x = 5;
              spec.y = spec.full_y = 7;
          });
    EXPECT_NE(folder.read("a.png").find("oFFs"), std::string::npos);
    const ImageFile image = read(folder / "a.png");
    EXPECT_EQ(image.width, 4);
    EXPECT_EQ(image.height, 3);
    EXPECT_EQ(image.pixels.size(), 12u);
    EXPECT_EQ(image.data.x, 0);
}

TEST(ImageFile, colourCodingIsWhatTheFileSays)
{
    const TemporaryFolder folder;
    const auto coded = [&](const std::string& name, OIIO::TypeDesc type, const char* space) {
        write(folder / name, {0, 0, 4, 4}, 3, type, half, [&](OIIO::ImageSpec& spec) {
            if (*space) spec.attribute("oiio:ColorSpace", space);
        });
        return read(folder / name);
    };
    const auto u8 = OIIO::TypeDesc::UINT8, u16 = OIIO::TypeDesc::UINT16,
               f32 = OIIO::TypeDesc::FLOAT, f16 = OIIO::TypeDesc::HALF;
    for (const auto& type : {u8, u16}) {
        EXPECT_EQ(coded("a.png", type, "sRGB").coding, ColourCoding::srgb);
        EXPECT_NE(folder.read("a.png").find("sRGB"), std::string::npos);
        EXPECT_EQ(coded("a.png", type, "").coding, ColourCoding::srgb) << "PNG's own rule";
        EXPECT_EQ(folder.read("a.png").find("sRGB"), std::string::npos);
        EXPECT_EQ(folder.read("a.png").find("gAMA"), std::string::npos);
        EXPECT_EQ(coded("a.png", type, "Linear").coding, ColourCoding::linear);
        const ImageFile gamma = coded("a.png", type, "Gamma1.8");
        EXPECT_EQ(gamma.coding, ColourCoding::gamma);
        EXPECT_NEAR(gamma.gamma, 1.8, 1e-5);
        EXPECT_NE(folder.read("a.png").find("gAMA"), std::string::npos);
        EXPECT_EQ(coded("a.tif", type, "sRGB").coding, ColourCoding::srgb);
        EXPECT_EQ(coded("a.tif", type, "").coding, ColourCoding::srgb);
    }
    EXPECT_EQ(coded("a.tif", f32, "").coding, ColourCoding::linear);
    EXPECT_EQ(coded("a.exr", f16, "").coding, ColourCoding::linear);
    EXPECT_EQ(coded("a.exr", f32, "").coding, ColourCoding::linear);
    EXPECT_EQ(coded("a.hdr", f32, "").coding, ColourCoding::linear);
    for (const char* name : {"a.jpg", "a.tga", "a.bmp", "a.gif", "a.ppm"})
        EXPECT_EQ(coded(name, u8, "").coding, ColourCoding::srgb) << name;
    const ImageFile tga = coded("a.tga", u8, "Gamma2.2");
    EXPECT_EQ(tga.coding, ColourCoding::gamma);
    EXPECT_NEAR(tga.gamma, 2.2, 1e-5);
}

/// Writes a file of every format, under its ending.
void writeAll(const TemporaryFolder& folder, std::vector<std::string>& names)
{
    const auto value = [](int x, int y, int c) {
        return float((x * 37 + y * 91 + c * 53) % 100) / 100;
    };
    const auto add = [&](const std::string& name, int channels, OIIO::TypeDesc type,
                         const char* compression) {
        write(folder / name, {0, 0, 33, 29}, channels, type, value, [&](OIIO::ImageSpec& spec) {
            if (*compression) spec.attribute("compression", compression);
        });
        names.push_back(name);
    };
    add("a.png", 3, OIIO::TypeDesc::UINT8, "");
    add("b.png", 4, OIIO::TypeDesc::UINT16, "");
    for (const char* c : {"none", "rle", "zip", "zips", "piz", "pxr24", "b44", "dwaa"})
        add(std::string(c) + ".exr", 3, OIIO::TypeDesc::HALF, c);
    for (const char* c : {"none", "lzw", "zip", "packbits", "jpeg"})
        add(std::string(c) + ".tif", 3, OIIO::TypeDesc::UINT8, c);
    add("a.jpg", 3, OIIO::TypeDesc::UINT8, "");
    add("a.hdr", 3, OIIO::TypeDesc::FLOAT, "");
    add("a.tga", 3, OIIO::TypeDesc::UINT8, "");
    add("rle.tga", 4, OIIO::TypeDesc::UINT8, "rle");
    add("a.bmp", 3, OIIO::TypeDesc::UINT8, "");
    add("a.ppm", 3, OIIO::TypeDesc::UINT8, "");
    add("a.gif", 3, OIIO::TypeDesc::UINT8, "");
}

// The size that each format's header promises becomes 60000 x 60000 (JPEG and HDR likewise).
TEST(ImageFile, promisesThatTheFileCannotKeepTakeNoMemory)
{
    const TemporaryFolder folder;
    std::vector<std::string> names;
    writeAll(folder, names);
    const std::string big_endian{'\0', '\0', char(0xea), char(0x60)};
    const std::string little_endian{char(0x60), char(0xea), '\0', '\0'};
    const double before = peakMegabytes();
    for (const std::string& name : names) {
        std::string bytes = folder.read(name);
        const std::string ending = name.substr(name.size() - 3);
        const auto put = [&](std::size_t at, const std::string& number) {
            bytes.replace(at, number.size(), number);
        };
        if (ending == "png") put(16, big_endian), put(20, big_endian);
        if (ending == "exr") {
            const std::size_t at = bytes.find("dataWindow") + 11 + 6 + 4;
            put(at + 8, little_endian), put(at + 12, little_endian);
        }
        if (ending == "tif") { // the entries of ImageWidth and ImageLength, 16-bit numbers
            for (const char tag : {'\0', '\1'}) {
                const std::size_t at = bytes.find(std::string{tag, '\1', '\3', '\0', '\1'});
                ASSERT_NE(at, std::string::npos) << name;
                put(at + 8, little_endian);
            }
        }
        if (ending == "jpg") {
            const std::size_t at = bytes.find("\xff\xc0");
            put(at + 5, big_endian.substr(2)), put(at + 7, big_endian.substr(2));
        }
        if (ending == "hdr") {
            const std::string size = "-Y 29 +X 33";
            ASSERT_NE(bytes.find(size), std::string::npos);
            bytes.replace(bytes.find(size), size.size(), "-Y 60000 +X 60000");
        }
        if (ending == "tga")
            put(12, little_endian.substr(0, 2)), put(14, little_endian.substr(0, 2));
        if (ending == "bmp") put(18, little_endian), put(22, little_endian);
        if (ending == "gif") put(6, little_endian.substr(0, 2)), put(8, little_endian.substr(0, 2));
        if (ending == "ppm") bytes.replace(bytes.find("33 29"), 5, "60000 60000");
        const auto file = folder.write("promise_" + name, bytes);
        const std::string message = messageOf([&] { read(file); });
        EXPECT_NE(message.find("promise_" + name), std::string::npos) << message;
        if (ending != "tif" && ending != "exr") {
            EXPECT_NE(message.find("60000 x 60000"), std::string::npos) << message;
        }
    }
    EXPECT_LT(peakMegabytes() - before, 300);
}

// Cut anywhere before its last part, a file is an error; JPEG's last bytes may be missing as they
// are no pixels.
TEST(ImageFile, truncatedFilesAreRefused)
{
    const TemporaryFolder folder;
    std::vector<std::string> names;
    writeAll(folder, names);
    for (const std::string& name : names) {
        EXPECT_NO_THROW(read(folder / name));
        const std::string bytes = folder.read(name);
        for (const double part : {0.02, 0.3, 0.6, 0.85}) {
            if (name == "a.tga" && part > 0.8) continue; // cuts the thumbnail behind the pixels
            const auto file = folder.write(
                "cut_" + name, bytes.substr(0, std::size_t(part * double(bytes.size()))));
            EXPECT_THROW(read(file), Error) << name << " of " << bytes.size() << ": " << part;
        }
    }
}

// Each scan of a JPEG is decoded over the whole picture, however short it is.
TEST(ImageFile, aJpegHasFewScans)
{
    const TemporaryFolder folder;
    write(folder / "a.jpg", {0, 0, 16, 16}, 3, OIIO::TypeDesc::UINT8, half);
    std::string bytes = folder.read("a.jpg");
    for (int i = 0; i < 200; ++i) bytes.insert(bytes.size() - 2, "\xff\xda\x02");
    const std::string message = messageOf([&] { read(folder.write("b.jpg", bytes)); });
    EXPECT_NE(message.find("201 scans"), std::string::npos) << message;
}

// What the libraries below look up without a look at its length.
TEST(ImageFile, indicesOutsideOfAPaletteAreRefused)
{
    const TemporaryFolder folder;
    const auto numbers = [](std::initializer_list<int> list) {
        std::string bytes;
        for (const int x : list) bytes.push_back(static_cast<char>(x));
        return bytes;
    };
    // 2 x 1 pixels with a palette of two colours, red and green, and the indices given.
    const auto bmp = [&](int first, int second) {
        return "BM" + numbers({66, 0, 0, 0, 0, 0, 0, 0, 62, 0, 0, 0})
            + numbers({40, 0, 0, 0, 2, 0, 0, 0, 1, 0, 0, 0, 1, 0, 8, 0, 0, 0, 0, 0})
            + numbers({4, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 2, 0, 0, 0, 0, 0, 0, 0})
            + numbers({0, 0, 255, 0, 0, 255, 0, 0}) + numbers({first, second, 0, 0});
    };
    const ImageFile good = read(folder.write("a.bmp", bmp(1, 0)));
    ASSERT_EQ(good.channels.size(), 3u);
    EXPECT_EQ(good.pixels, (std::vector<float>{0, 1, 0, 1, 0, 0}));
    EXPECT_THROW(read(folder.write("b.bmp", bmp(1, 2))), Error);
    EXPECT_THROW(read(folder.write("c.bmp", bmp(255, 0))), Error);
    // A GIF of 2 x 1 pixels whose picture stands at `left`, and its bits of an index: the codes
    // clear, 1, 0, end (of 3 bits).
    const auto gif = [&](int left, int bits) {
        return "GIF89a" + numbers({2, 0, 1, 0, 0x80, 0, 0}) + numbers({255, 0, 0, 0, 255, 0})
            + numbers({0x2c, left, 0, 0, 0, 2, 0, 1, 0, 0, bits, 2, 0x0c, 0x0a, 0, 0x3b});
    };
    const ImageFile green = read(folder.write("a.gif", gif(0, 2)));
    EXPECT_EQ(green.pixels.at(0), 0);
    EXPECT_EQ(green.pixels.at(1), 1);
    EXPECT_THROW(read(folder.write("b.gif", gif(1, 2))), Error);
    EXPECT_THROW(read(folder.write("c.gif", gif(0, 8))), Error);
}

TEST(ImageFile, theBytesTellTheFormatAndNamesAreAnything)
{
    const TemporaryFolder folder;
    write(folder / "a.png", {0, 0, 2, 2}, 3, OIIO::TypeDesc::UINT8, half);
    for (const char* name : {"a.jpg", "picture", "a?b=1.png", "a*.png", "a\nb.png", "%04d.png",
                             "a b;$(x).png", "\xe4.png"}) {
        std::filesystem::copy_file(folder / "a.png", folder / name);
        EXPECT_EQ(read(folder / name).width, 2) << name;
    }
    const std::string message = messageOf([&] { read(folder.write("x.png", "no image")); });
    EXPECT_NE(message.find("PNG, EXR"), std::string::npos) << message;
    EXPECT_NE(messageOf([&] { read(folder.write("e.png", "")); }).find("empty"), std::string::npos);
    EXPECT_THROW(read(folder.path()), Error);
    EXPECT_THROW(read("/dev/null"), Error);
    EXPECT_THROW(read(folder / "none.png"), Error);
}

} // namespace
} // namespace volcomp
