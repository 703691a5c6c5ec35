// SPDX-License-Identifier: Apache-2.0
#include "volcomp/base/image_header.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstring>

#include <fmt/format.h>

#include "volcomp/base/error.h"
#include "volcomp/base/image_bytes.h"

namespace volcomp {
namespace {

constexpr double kDeflate = 1032; // 258 bytes of at least 2 bits
constexpr int kMostScans = 100;

std::string formatOf(const std::filesystem::path& file, const std::string& head)
{
    const auto starts = [&](const char* text, std::size_t length) {
        return head.compare(0, length, text, length) == 0 && head.size() >= length;
    };
    if (starts("\x89PNG\r\n\x1a\n", 8)) return "png";
    if (starts("\x76\x2f\x31\x01", 4)) return "openexr";
    for (const auto& tiff : {std::array{'I', 'I', '*', '\0'},
                             {'M', 'M', '\0', '*'},
                             {'I', 'I', '+', '\0'},
                             {'M', 'M', '\0', '+'}})
        if (starts(tiff.data(), tiff.size())) return "tiff";
    if (starts("\xff\xd8\xff", 3)) return "jpeg";
    if (starts("#?RADIANCE", 10) || starts("#?RGBE", 6)) return "hdr";
    if (starts("BM", 2)) return "bmp";
    if (starts("GIF8", 4)) return "gif";
    if (head.size() > 2 && head[0] == 'P' && std::strchr("123456Ff", head[1])
        && std::isspace(static_cast<unsigned char>(head[2])))
        return "pnm";
    std::string ending = file.extension().string();
    std::transform(ending.begin(), ending.end(), ending.begin(),
                   [](unsigned char c) { return char(std::tolower(c)); });
    return ending == ".tga" || ending == ".tpic" ? "targa" : "";
}

/// The IHDR chunk holds the size, the bits of a sample and the kind of colour.
void checkPng(const std::filesystem::path& file, const ImageHeader& header, const ImageBytes& bytes)
{
    const std::uint32_t kind = bytes.number(25, 1, true);
    const double samples = kind == 2 ? 3 : kind == 4 ? 2 : kind == 6 ? 4 : 1;
    checkImageSize(file, header, bytes.number(16, 4, true), bytes.number(20, 4, true), 1,
                   samples * bytes.number(24, 1, true) / 8, "zip");
}

/// Finds the frame's size behind the segments before it, and counts the scans: each of them is
/// decoded over the whole picture.
void checkJpeg(const std::filesystem::path& file, const ImageHeader& header,
               const ImageBytes& bytes)
{
    std::int64_t at = 2;
    for (bool found = false; !found;) {
        if (bytes.number(at, 1, true) != 0xff) throw bytes.damaged("something between its parts");
        const std::uint32_t marker = bytes.number(at + 1, 1, true);
        if (marker == 0xff) {
            ++at;
            continue;
        }
        if (marker == 0x01 || (marker >= 0xd0 && marker <= 0xd7)) {
            at += 2;
            continue;
        }
        const std::uint32_t length = bytes.number(at + 2, 2, true);
        if (length < 2 || marker == 0xda || marker == 0xd9)
            throw bytes.damaged("no frame before the picture's data");
        if (marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8
            && marker != 0xcc) {
            checkImageSize(file, header, bytes.number(at + 7, 2, true),
                           bytes.number(at + 5, 2, true), bytes.number(at + 9, 1, true), 1, "");
            found = true;
        }
        at += 2 + length;
    }
    int scans = 0;
    char last = 0;
    bool ends = false;
    for (; at < bytes.size(); at += 1 << 20)
        for (const char c : bytes.read(at, 1 << 20)) {
            scans += last == '\xff' && c == '\xda';
            ends = ends || (scans > 0 && last == '\xff' && c == '\xd9');
            last = c;
        }
    if (!ends) throw bytes.damaged("a JPEG without its end");
    if (scans > kMostScans)
        throw bytes.damaged(fmt::format("{} scans, more than {}", scans, kMostScans));
}

void checkTarga(const std::filesystem::path& file, const ImageHeader& header,
                const ImageBytes& bytes)
{
    const std::uint32_t palette = bytes.number(1, 1, false), kind = bytes.number(2, 1, false),
                        bits = bytes.number(16, 1, false);
    const bool grey = kind == 3 || kind == 11, colour = kind == 2 || kind == 10;
    if (palette != 0 || !(grey || colour)
        || !(grey ? bits == 8 : bits == 16 || bits == 24 || bits == 32))
        throw bytes.refused("a TGA without a palette, of 8 bits (grey), 16, 24 or 32 bits",
                            fmt::format("kind {} of {} bits", kind, bits));
    checkImageSize(file, header, bytes.number(12, 2, false), bytes.number(14, 2, false), 1,
                   bits / 8.0, kind > 8 ? "rle" : "none");
}

void checkBmp(const std::filesystem::path& file, const ImageHeader& header, const ImageBytes& bytes)
{
    const std::uint32_t head = bytes.number(14, 4, false);
    const bool old = head == 12; // OS/2's, with a size of 16 bits
    const std::int64_t width =
        old ? bytes.number(18, 2, false) : static_cast<std::int32_t>(bytes.number(18, 4, false));
    const std::int64_t height =
        old ? bytes.number(20, 2, false) : static_cast<std::int32_t>(bytes.number(22, 4, false));
    const std::uint32_t bits = bytes.number(old ? 24 : 28, 2, false),
                        compression = old ? 0 : bytes.number(30, 4, false);
    if (!old && (head < 40 || head > 1000)) throw bytes.damaged("an unknown header");
    if (compression != 0 && compression != 3)
        throw bytes.refused("a BMP that is not compressed", "a compressed one");
    if (bits != 1 && bits != 4 && bits != 8 && bits != 16 && bits != 24 && bits != 32)
        throw bytes.damaged(fmt::format("{} bits a pixel", bits));
    checkImageSize(file, header, width, std::abs(height), 1, bits / 8.0, "none");
    const std::int64_t colours = old || head < 40 ? 0 : bytes.number(46, 4, false);
    if (colours > 256) throw bytes.damaged(fmt::format("a palette of {} colours", colours));
    if (bits > 8 || colours == 0 || colours == std::int64_t(1) << bits) return;
    // OpenImageIO does not compare the indices with the palette's length.
    if (bits != 8) throw bytes.refused("a BMP with a whole palette", "a part of one");
    const std::int64_t row = (width + 3) / 4 * 4, first = bytes.number(10, 4, false);
    for (std::int64_t y = 0; y < std::abs(height); ++y)
        for (const char index : bytes.read(first + y * row, width))
            if (static_cast<unsigned char>(index) >= colours)
                throw bytes.damaged("a colour that the palette does not have");
}

/// The canvas of all its pictures, of bytes in RGBA, is one piece of memory. Neither giflib nor
/// OpenImageIO compares the first picture with the canvas and its indices with the palette.
void checkGif(const std::filesystem::path& file, const ImageHeader& header, const ImageBytes& bytes)
{
    const std::uint32_t width = bytes.number(6, 2, false), height = bytes.number(8, 2, false);
    checkImageSize(file, header, width, height, 4, 1, "");
    const auto colours_of = [](std::uint32_t flags) {
        return flags & 0x80 ? std::int64_t(2) << (flags & 7) : 0;
    };
    std::int64_t colours = colours_of(bytes.number(10, 1, false)), at = 13 + 3 * colours;
    std::uint32_t block = bytes.number(at, 1, false);
    for (; block == 0x21; block = bytes.number(at, 1, false)) { // an extension of several pieces
        at += 2;
        while (const std::uint32_t length = bytes.number(at, 1, false)) at += 1 + length;
        ++at;
    }
    if (block != 0x2c) throw bytes.damaged("a GIF without a picture");
    const auto field = [&](int i) { return bytes.number(at + 1 + 2 * i, 2, false); };
    if (field(2) < 1 || field(3) < 1 || field(0) + field(2) > width || field(1) + field(3) > height)
        throw bytes.damaged("a picture that reaches out of its canvas");
    const std::int64_t own = colours_of(bytes.number(at + 9, 1, false));
    if (own > 0) colours = own;
    const std::uint32_t bits = bytes.number(at + 10 + 3 * own, 1, false);
    if (colours == 0 || bits < 1 || bits > 8 || (bits > 2 && std::int64_t(1) << bits > colours))
        throw bytes.damaged("colours that its palette does not have");
}

} // namespace

double mostBytesOfAByte(const std::string& format, const std::string& compression)
{
    const auto is = [&](const char* name) { return compression.rfind(name, 0) == 0; };
    // Formats whose samples become larger when they are read: a bit or an index becomes bytes.
    if (format == "pnm") return 8;
    if (format == "hdr") return 200; // 127 bytes of 4 in 2 bytes, which become floats
    if (format == "gif") return 4 * 2731.0;
    if (format == "jpeg") return 1300; // a bit holds 64 samples; chroma may be a quarter
    if (format == "targa" || format == "bmp") return is("rle") ? 65 : 1.01;
    if (format == "openexr") return is("dwa") ? 64 * kDeflate : kDeflate;
    if (format == "png") return kDeflate;
    // TIFF, where a palette's index becomes three samples and a bit becomes a byte.
    if (is("none")) return 24;
    if (is("packbits")) return 24 * 64.0;
    if (is("lzw")) return 24 * 2731.0;
    if (is("zip") || is("jpeg")) return 24 * 1300.0;
    return 24 * 10000.0;
}

void checkImageSize(const std::filesystem::path& file, const ImageHeader& header,
                    std::int64_t width, std::int64_t height, double channels, double pixel_bytes,
                    const std::string& compression)
{
    if (width < 1 || height < 1 || channels < 1)
        throw fileError(file, "", "an image with pixels",
                        fmt::format("{} x {} pixels of {} channels", width, height, channels));
    const double pixels = double(width) * double(height);
    if (width > kMostPixelsAcross || height > kMostPixelsAcross || channels > kMostImageChannels
        || pixels * channels > kMostImageValues)
        throw fileError(
            file, "",
            fmt::format("an image of at most {:g} values, {} pixels along a side and {} channels",
                        kMostImageValues, kMostPixelsAcross, kMostImageChannels),
            fmt::format("{} x {} pixels of {} channels", width, height, channels),
            "Make it smaller.");
    const double most = mostBytesOfAByte(header.format, compression) * header.bytes;
    if (pixels * channels * pixel_bytes > most + 4096)
        throw fileError(file, "", "a complete image",
                        fmt::format("a header that promises {} x {} pixels in a file of {:.0f} "
                                    "bytes, which cannot hold them",
                                    width, height, header.bytes),
                        "Is the file complete?");
}

ImageHeader checkImageHeader(const std::filesystem::path& file, std::FILE* stream)
{
    const ImageBytes bytes(file, stream);
    ImageHeader header{formatOf(file, bytes.read(0, 16)), double(bytes.size())};
    if (header.format.empty())
        throw fileError(file, "",
                        "a PNG, EXR, TIFF, JPEG, HDR, TGA, BMP, PNM (PGM, PPM, PFM) or GIF image",
                        bytes.size() == 0 ? "an empty file" : "something else");
    if (header.format == "png") checkPng(file, header, bytes);
    if (header.format == "jpeg") checkJpeg(file, header, bytes);
    if (header.format == "openexr") checkExr(file, header, bytes);
    header.has_display =
        header.format == "openexr" || (header.format == "tiff" && checkTiff(bytes));
    if (header.format == "targa") checkTarga(file, header, bytes);
    if (header.format == "bmp") checkBmp(file, header, bytes);
    if (header.format == "gif") checkGif(file, header, bytes);
    return header;
}

} // namespace volcomp
