// SPDX-License-Identifier: Apache-2.0
#include "volcomp/base/image_header.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstring>
#include <vector>

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "volcomp/base/error.h"

namespace volcomp {
namespace {

constexpr double kDeflate = 1032; // 258 bytes of at least 2 bits
constexpr std::int64_t kMostTile = 1 << 24;
constexpr int kMostChannels = 1024, kMostScans = 100;

/// The bytes of an open file.
class Bytes {
public:
    Bytes(const std::filesystem::path& file, std::FILE* stream)
        : m_file(file), m_handle(fileno(stream))
    {
        struct stat about;
        if (fstat(m_handle, &about) != 0 || !S_ISREG(about.st_mode)) throw damaged("not a file");
        m_size = about.st_size;
    }
    std::int64_t size() const { return m_size; }

    /// `count` bytes from `at` on; fewer at the file's end.
    std::string read(std::int64_t at, std::int64_t count) const
    {
        std::string bytes(std::size_t(std::clamp<std::int64_t>(m_size - at, 0, count)), '\0');
        std::size_t done = 0;
        while (done < bytes.size()) {
            const ssize_t got =
                pread(m_handle, bytes.data() + done, bytes.size() - done, at + std::int64_t(done));
            if (got <= 0) break;
            done += std::size_t(got);
        }
        bytes.resize(done);
        return bytes;
    }
    /// An unsigned number of `count` bytes. Throws Error at the file's end.
    std::uint32_t number(std::int64_t at, int count, bool big_endian) const
    {
        const std::string bytes = read(at, count);
        if (bytes.size() != std::size_t(count)) throw damaged("a header that ends too early");
        std::uint32_t value = 0;
        for (int i = 0; i < count; ++i)
            value = value << 8 | static_cast<unsigned char>(bytes[big_endian ? i : count - 1 - i]);
        return value;
    }
    Error damaged(const std::string& found) const
    {
        return fileError(m_file, "", "a complete image", found, "Is the file damaged?");
    }
    /// For a kind of a format that this program does not read.
    Error refused(const std::string& expected, const std::string& found) const
    {
        return fileError(m_file, "", expected, found, "Save it as another kind.");
    }

private:
    std::filesystem::path m_file;
    int m_handle;
    std::int64_t m_size = 0;
};

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
void checkPng(const std::filesystem::path& file, const ImageHeader& header, const Bytes& bytes)
{
    const std::uint32_t kind = bytes.number(25, 1, true);
    const double samples = kind == 2 ? 3 : kind == 4 ? 2 : kind == 6 ? 4 : 1;
    checkImageSize(file, header, bytes.number(16, 4, true), bytes.number(20, 4, true), 1,
                   samples * bytes.number(24, 1, true) / 8, "zip");
}

/// Finds the frame's size behind the segments before it, and counts the scans: each of them is
/// decoded over the whole picture.
void checkJpeg(const std::filesystem::path& file, const ImageHeader& header, const Bytes& bytes)
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

/// The first directory of a TIFF or BigTIFF. libtiff gives strips that lie behind the file's end
/// without an error, so they are checked here.
class TiffDirectory {
public:
    explicit TiffDirectory(const Bytes& bytes)
        : m_bytes(bytes), m_big_endian(bytes.read(0, 1) == "M"),
          m_wide(bytes.number(2, 2, m_big_endian) == 43)
    {
        const std::int64_t at = m_wide ? number(8, 8) : number(4, 4);
        const std::int64_t count = m_wide ? number(at, 8) : number(at, 2);
        m_first = at + (m_wide ? 8 : 2);
        if (count < 1 || count > 65535 || m_first + count * entrySize() > m_bytes.size())
            throw m_bytes.damaged("a directory that lies outside of the file");
        m_count = count;
    }

    /// The numbers of an entry; none if the directory does not have it.
    std::vector<std::int64_t> values(std::uint32_t tag) const
    {
        for (std::int64_t i = 0; i < m_count; ++i) {
            const std::int64_t at = m_first + i * entrySize();
            if (m_bytes.number(at, 2, m_big_endian) != tag) continue;
            const std::uint32_t type = m_bytes.number(at + 2, 2, m_big_endian);
            const int size = type == 3 ? 2 : type == 4 ? 4 : type == 16 ? 8 : type == 1 ? 1 : 0;
            const std::int64_t count = number(at + 4, m_wide ? 8 : 4);
            if (size == 0 || count < 0 || count > m_bytes.size())
                throw m_bytes.damaged(fmt::format("an entry {} that is not numbers", tag));
            const std::int64_t inside = m_wide ? 8 : 4, place = at + 4 + inside;
            const std::int64_t from = size * count <= inside ? place : number(place, int(inside));
            return numbers(from, size, count);
        }
        return {};
    }

private:
    std::int64_t entrySize() const { return m_wide ? 20 : 12; }
    std::int64_t number(std::int64_t at, int size) const { return numbers(at, size, 1)[0]; }
    std::vector<std::int64_t> numbers(std::int64_t at, int size, std::int64_t count) const
    {
        if (at < 0 || at > m_bytes.size() || count * size > m_bytes.size() - at)
            throw m_bytes.damaged("an entry that lies outside of the file");
        const std::string bytes = m_bytes.read(at, count * size);
        std::vector<std::int64_t> result;
        for (std::size_t i = 0; i + std::size_t(size) <= bytes.size(); i += std::size_t(size)) {
            std::uint64_t value = 0;
            for (int k = 0; k < size; ++k)
                value = value << 8
                    | static_cast<unsigned char>(
                            bytes[i + std::size_t(m_big_endian ? k : size - 1 - k)]);
            result.push_back(static_cast<std::int64_t>(value));
        }
        if (std::int64_t(result.size()) != count) throw m_bytes.damaged("a shorter file");
        return result;
    }

    const Bytes& m_bytes;
    bool m_big_endian, m_wide;
    std::int64_t m_first = 0, m_count = 0;
};

/// Checks that the pieces of pixels lie in the file; says whether it has a display window.
bool checkTiff(const Bytes& bytes)
{
    constexpr std::uint32_t kFullWidth = 33300; // Pixar's PIXAR_IMAGEFULLWIDTH
    const TiffDirectory directory(bytes);
    const bool tiled = !directory.values(324).empty();
    const auto offsets = directory.values(tiled ? 324 : 273),
               sizes = directory.values(tiled ? 325 : 279);
    if (offsets.empty() || sizes.size() < offsets.size())
        throw bytes.damaged("a directory without the places of its pixels");
    const auto height = directory.values(257), rows = directory.values(278); // rows in a strip
    if (!tiled && !height.empty() && !rows.empty()
        && double(offsets.size()) * double(rows[0]) < double(height[0]))
        throw bytes.damaged("fewer strips than its rows need");
    for (std::size_t i = 0; i < offsets.size(); ++i)
        if (offsets[i] < 0 || sizes[i] < 0 || offsets[i] > bytes.size()
            || sizes[i] > bytes.size() - offsets[i])
            throw bytes.damaged(fmt::format(
                "piece {} of its {} pieces of pixels outside of the file", i + 1, offsets.size()));
    return !directory.values(kFullWidth).empty();
}

/// What the attributes of one part of an EXR say.
struct ExrPart {
    std::int64_t width = 0, height = 0, tile_width = 0, tile_height = 0;
    int compression = -1, tile_mode = 0;
    double pixel_bytes = 0;
    int channels = 0;
};

class ExrHeader {
public:
    explicit ExrHeader(const Bytes& bytes) : m_bytes(bytes) { }

    void check(const std::filesystem::path& file, const ImageHeader& header)
    {
        const std::uint32_t flags = m_bytes.number(4, 4, false);
        if ((flags & 0xff) > 2) throw m_bytes.refused("EXR of version 2", "a later one");
        if (flags & 0x800) throw m_bytes.refused("a flat image", "a deep EXR");
        const bool several = flags & 0x1000;
        do {
            const ExrPart part = readPart();
            checkImageSize(file, header, part.width, part.height, part.channels,
                           part.pixel_bytes / std::max(1, part.channels),
                           part.compression >= 8 ? "dwaa" : "zip");
            checkChunks(part, (flags & 0x200) != 0);
        } while (several && m_bytes.number(m_at, 1, false) != 0);
    }

private:
    /// The text at the present place, without its final zero.
    std::string text()
    {
        const std::string bytes = m_bytes.read(m_at, 256);
        const std::size_t end = bytes.find('\0');
        if (end == std::string::npos) throw m_bytes.damaged("a name without an end");
        m_at += std::int64_t(end) + 1;
        return bytes.substr(0, end);
    }
    std::int64_t signedNumber(std::int64_t at) const
    {
        return static_cast<std::int32_t>(m_bytes.number(at, 4, false));
    }

    ExrPart readPart()
    {
        ExrPart part;
        for (std::string name = text(); !name.empty(); name = text()) {
            const std::string type = text();
            const std::int64_t size = m_bytes.number(m_at, 4, false);
            const std::int64_t end = m_at + 4 + size;
            if (end > m_bytes.size())
                throw m_bytes.damaged("the attribute '" + name + "' longer than the file");
            m_at += 4;
            readAttribute(name, type, size, part);
            m_at = end;
        }
        if (part.width < 1 || part.channels < 1 || part.compression < 0)
            throw m_bytes.damaged("a header without its data window, channels or compression");
        return part;
    }

    void readAttribute(const std::string& name, const std::string& type, std::int64_t size,
                       ExrPart& part)
    {
        if (name == "dataWindow") {
            part.width = signedNumber(m_at + 8) - signedNumber(m_at) + 1;
            part.height = signedNumber(m_at + 12) - signedNumber(m_at + 4) + 1;
            if (part.width < 1 || part.height < 1) throw m_bytes.damaged("no pixels");
        } else if (name == "compression") {
            part.compression = int(m_bytes.number(m_at, 1, false));
        } else if (name == "tiles") {
            part.tile_width = m_bytes.number(m_at, 4, false);
            part.tile_height = m_bytes.number(m_at + 4, 4, false);
            part.tile_mode = int(m_bytes.number(m_at + 8, 1, false) & 15);
        } else if (name == "channels") {
            readChannels(size, part);
        } else if (type == "preview") {
            const double pixels =
                double(m_bytes.number(m_at, 4, false)) * m_bytes.number(m_at + 4, 4, false);
            if (pixels * 4 + 8 != double(size)) throw m_bytes.damaged("a wrong preview");
        }
    }

    void readChannels(std::int64_t size, ExrPart& part)
    {
        const std::int64_t end = m_at + size;
        while (m_at < end && m_bytes.number(m_at, 1, false) != 0) {
            text();
            const std::uint32_t type = m_bytes.number(m_at, 4, false);
            const std::int64_t across = signedNumber(m_at + 8), down = signedNumber(m_at + 12);
            if (type > 2 || across < 1 || down < 1 || across > 64 || down > 64)
                throw m_bytes.damaged("a channel of an unknown type or sampling");
            part.pixel_bytes += type == 1 ? 2 : 4;
            m_at += 16;
            if (++part.channels > kMostChannels) throw m_bytes.damaged("too many channels");
        }
    }

    /// Each chunk of rows, and each tile, has an offset of 8 bytes in the file.
    void checkChunks(const ExrPart& part, bool tiled) const
    {
        static constexpr std::array<int, 10> kRows{1, 1, 1, 16, 32, 16, 32, 32, 32, 256};
        if (part.compression >= int(kRows.size()))
            throw m_bytes.refused("a compression that OpenEXR 3.1 knows", "another one");
        double chunks = double(part.height) / kRows[std::size_t(part.compression)];
        if (tiled || part.tile_width > 0) {
            if (part.tile_width < 1 || part.tile_height < 1
                || part.tile_width > kMostTile / part.tile_height)
                throw m_bytes.refused(fmt::format("tiles of at most {} pixels", kMostTile),
                                      fmt::format("{} x {}", part.tile_width, part.tile_height));
            chunks = (double(part.width) / double(part.tile_width))
                * (double(part.height) / double(part.tile_height));
        }
        if (std::max(1.0, chunks) * 8 > double(m_bytes.size()))
            throw m_bytes.damaged("fewer pieces than its header promises");
    }

    const Bytes& m_bytes;
    std::int64_t m_at = 8;
};

void checkTarga(const std::filesystem::path& file, const ImageHeader& header, const Bytes& bytes)
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

void checkBmp(const std::filesystem::path& file, const ImageHeader& header, const Bytes& bytes)
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
void checkGif(const std::filesystem::path& file, const ImageHeader& header, const Bytes& bytes)
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
    if (width > kMostPixelsAcross || height > kMostPixelsAcross || channels > kMostChannels
        || pixels * channels > kMostImageValues)
        throw fileError(
            file, "",
            fmt::format("an image of at most {:g} values, {} pixels along a side and {} channels",
                        kMostImageValues, kMostPixelsAcross, kMostChannels),
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
    const Bytes bytes(file, stream);
    ImageHeader header{formatOf(file, bytes.read(0, 16)), double(bytes.size())};
    if (header.format.empty())
        throw fileError(file, "",
                        "a PNG, EXR, TIFF, JPEG, HDR, TGA, BMP, PNM (PGM, PPM, PFM) or GIF image",
                        bytes.size() == 0 ? "an empty file" : "something else");
    if (header.format == "png") checkPng(file, header, bytes);
    if (header.format == "jpeg") checkJpeg(file, header, bytes);
    if (header.format == "openexr") ExrHeader(bytes).check(file, header);
    header.has_display =
        header.format == "openexr" || (header.format == "tiff" && checkTiff(bytes));
    if (header.format == "targa") checkTarga(file, header, bytes);
    if (header.format == "bmp") checkBmp(file, header, bytes);
    if (header.format == "gif") checkGif(file, header, bytes);
    return header;
}

} // namespace volcomp
