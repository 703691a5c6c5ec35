// SPDX-License-Identifier: Apache-2.0
#include "volcomp/base/image_file.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <new>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>

#include "volcomp/base/error.h"
#include "volcomp/base/image_header.h"
#include "volcomp/base/srgb.h"

namespace volcomp {
namespace {

constexpr std::int64_t kMostTile = 1 << 24;      ///< pixels
constexpr std::int64_t kValuesAtATime = 1 << 22; ///< about what is decoded at a time

struct Closer {
    void operator()(std::FILE* stream) const { std::fclose(stream); }
};
using Stream = std::unique_ptr<std::FILE, Closer>;

Error broken(const std::filesystem::path& file, const std::string& why)
{
    return why.find("bad_alloc") != std::string::npos
        ? fileError(file, "", "memory for its pixels", "that this process is out of memory",
                    "Make the image smaller.")
        : fileError(file, "", "a complete image", "a broken one: " + why, "Is the file complete?");
}

std::string lower(std::string text)
{
    std::transform(text.begin(), text.end(), text.begin(),
                   [](unsigned char c) { return char(std::tolower(c)); });
    return text;
}

/// How the colours are coded, by the names that OpenImageIO has for it. Netpbm's page says
/// "Rec. 709", but the programs that write PNM put sRGB into it.
void readCoding(const OIIO::ImageSpec& spec, ImageFile& image)
{
    const std::string name = lower(spec.get_string_attribute("oiio:ColorSpace"));
    double gamma = spec.get_float_attribute("oiio:Gamma", 0);
    if (gamma <= 0 && name.rfind("gamma", 0) == 0) gamma = std::atof(name.c_str() + 5);
    const bool floats = spec.format.is_floating_point();
    image.coding = ColourCoding::srgb;
    if (name == "srgb") return;
    if (gamma > 0.05 && gamma < 20 && name.rfind("lin", 0) != 0) {
        image.coding = gamma == 1 ? ColourCoding::linear : ColourCoding::gamma;
        image.gamma = gamma;
    } else if (name.find("lin") != std::string::npos || floats) image.coding = ColourCoding::linear;
}

/// A pixel's place by the file's own count.
struct Corner {
    int x, y;
};

/// Finds the display window and the data in it; returns the first pixel to keep. EXR has a display
/// window, and TIFF may have one. An offset alone, which PNG knows too, is the place on a page and
/// means nothing to a map.
Corner readWindows(const OIIO::ImageSpec& spec, bool has_display, ImageFile& image)
{
    if (!has_display || spec.full_width < 1 || spec.full_height < 1) {
        image.width = spec.width;
        image.height = spec.height;
        image.data = {0, 0, spec.width, spec.height};
        return {spec.x, spec.y};
    }
    image.width = spec.full_width;
    image.height = spec.full_height;
    const auto cut = [](std::int64_t first, std::int64_t count, std::int64_t size, int& from,
                        int& number) {
        from = int(std::clamp<std::int64_t>(first, 0, size));
        number = int(std::clamp<std::int64_t>(first + count, 0, size)) - from;
    };
    cut(std::int64_t(spec.x) - spec.full_x, spec.width, image.width, image.data.x,
        image.data.width);
    cut(std::int64_t(spec.y) - spec.full_y, spec.height, image.height, image.data.y,
        image.data.height);
    if (image.data.width < 1 || image.data.height < 1) image.data = {};
    return {std::max(spec.x, spec.full_x), std::max(spec.y, spec.full_y)};
}

/// Reads pieces of whole rows and keeps what belongs to image.data, which begins at `corner`.
/// Memory grows with what really arrives.
void readPixels(OIIO::ImageInput& in, const OIIO::ImageSpec& spec, const Corner& corner,
                const std::filesystem::path& file, ImageFile& image)
{
    if (image.data.width < 1) return;
    const auto channels = std::size_t(spec.nchannels), width = std::size_t(spec.width);
    const std::size_t kept = std::size_t(image.data.width) * channels;
    const int bottom = corner.y + image.data.height;
    image.pixels.reserve(kept * std::size_t(image.data.height));
    // A multiple of 16 rows, if they fit, as several formats pack so many together.
    const auto fitting =
        std::clamp<std::int64_t>(kValuesAtATime / std::int64_t(width * channels), 1, 256);
    const int step =
        spec.tile_width > 0 ? spec.tile_height : int(fitting < 16 ? fitting : fitting / 16 * 16);
    std::vector<float> rows;
    for (std::int64_t y = spec.y; y < bottom; y += step) {
        const auto begin = int(y),
                   end = int(std::min<std::int64_t>(y + step, std::int64_t(spec.y) + spec.height));
        if (end <= corner.y) continue;
        rows.resize(std::size_t(end - begin) * width * channels);
        const bool good = spec.tile_width > 0
            ? in.read_tiles(0, 0, spec.x, spec.x + spec.width, begin, end, 0, 1, 0, spec.nchannels,
                            OIIO::TypeDesc::FLOAT, rows.data())
            : in.read_scanlines(0, 0, begin, end, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT,
                                rows.data());
        if (!good) throw broken(file, in.geterror());
        for (int row = std::max(begin, corner.y); row < std::min(end, bottom); ++row) {
            const std::size_t first =
                std::size_t(row - begin) * width + std::size_t(corner.x - spec.x);
            const auto from = rows.begin() + std::ptrdiff_t(first * channels);
            image.pixels.insert(image.pixels.end(), from, from + std::ptrdiff_t(kept));
        }
    }
}

ImageFile readOpened(const std::filesystem::path& file, std::FILE* stream, StoredAlpha alpha)
{
    const ImageHeader header = checkImageHeader(file, stream);
    OIIO::Filesystem::IOFile proxy(stream, OIIO::Filesystem::IOProxy::Read);
    OIIO::Filesystem::IOProxy* source = &proxy;
    OIIO::ImageSpec wish, spec;
    if (alpha == StoredAlpha::keep) wish.attribute("oiio:UnassociatedAlpha", 1);
    wish.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, static_cast<void*>(&source));
    // By the format's name, as create() of a file's name takes ? for the beginning of a query, and
    // tries every format that it knows if one fails.
    const auto in = OIIO::ImageInput::create(header.format);
    if (!in) throw broken(file, OIIO::geterror());
    if (!in->open(file.string(), spec, wish)) throw broken(file, in->geterror());
    if (spec.depth > 1 || spec.deep)
        throw fileError(file, "", "a flat image", "a deep one or a volume");
    checkImageSize(file, header, spec.width, spec.height, spec.nchannels,
                   header.format == "png" || header.format == "bmp" || header.format == "targa"
                           || header.format == "openexr"
                       ? 0 // has been checked with the samples as they are in the file
                       : double(spec.format.size()),
                   lower(spec.get_string_attribute("compression", "")));
    if (std::int64_t(spec.tile_width) * spec.tile_height > kMostTile)
        throw fileError(file, "", fmt::format("tiles of at most {} pixels", kMostTile),
                        fmt::format("{} x {}", spec.tile_width, spec.tile_height));
    ImageFile image;
    image.channels = spec.channelnames;
    image.channels.resize(std::size_t(spec.nchannels));
    image.alpha_channel = spec.alpha_channel;
    readCoding(spec, image);
    const Corner corner = readWindows(spec, header.has_display, image);
    readPixels(*in, spec, corner, file, image);
    return image;
}

/// The same, and what the libraries below throw becomes an Error.
ImageFile readGuarded(const std::filesystem::path& file, std::FILE* stream, StoredAlpha alpha)
{
    try {
        return readOpened(file, stream, alpha);
    } catch (const Error&) {
        throw;
    } catch (const std::bad_alloc&) {
        throw broken(file, "bad_alloc");
    } catch (const std::exception& e) { // of a library below OpenImageIO
        throw broken(file, e.what());
    }
}

} // namespace

void makeLinear(ImageFile& image)
{
    if (image.coding == ColourCoding::linear) return;
    const std::size_t channels = image.channels.size();
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
        if (static_cast<int>(i % channels) == image.alpha_channel) continue;
        float& x = image.pixels[i];
        x = image.coding == ColourCoding::srgb
            ? linearFromSrgb(x)
            : std::pow(std::max(0.0f, x), static_cast<float>(image.gamma));
    }
    image.coding = ColourCoding::linear;
}

ImageFile readImageFile(const std::filesystem::path& file, StoredAlpha alpha)
{
    std::error_code code;
    if (!std::filesystem::is_regular_file(file, code))
        throw fileError(file, "", "an image", "no file", "Check the path.");
    const Stream stream(std::fopen(file.c_str(), "rb"));
    if (!stream) throw fileError(file, "", "an image", "a file that cannot be opened");
    return readGuarded(file, stream.get(), alpha);
}

ImageFile readImageBytes(const std::filesystem::path& file, std::string_view bytes,
                         StoredAlpha alpha)
{
    if (bytes.empty()) throw fileError(file, "", "an image", "no bytes");
    std::string copy(bytes); // fmemopen() wants memory that it might write to
    const Stream stream(fmemopen(copy.data(), copy.size(), "rb"));
    if (!stream) throw fileError(file, "", "an image", "bytes that cannot be read");
    return readGuarded(file, stream.get(), alpha);
}

} // namespace volcomp
