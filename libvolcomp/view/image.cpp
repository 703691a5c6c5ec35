// SPDX-License-Identifier: Apache-2.0
#include "volcomp/view/image.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include <OpenImageIO/imageio.h>

#include "volcomp/base/atomic_file.h"
#include "volcomp/base/error.h"
#include "volcomp/base/image_file.h"
#include "volcomp/base/srgb.h"

namespace volcomp {
namespace {

/// Most values of a picture whose display window is more than its data.
constexpr double kMostBorder = 1e8;

/// Returns the place of a channel in each pixel, or -1 if the image does not have it.
int indexOf(const std::vector<std::string>& channels, const char* name)
{
    const auto at = std::find(channels.begin(), channels.end(), name);
    return at == channels.end() ? -1 : int(at - channels.begin());
}

/// Returns R, G, B and, with four channels, A as bytes in sRGB. A channel that the image does not
/// have is 0, alpha 1. PNG wants colours that are not multiplied by alpha.
std::vector<unsigned char> toBytes(const Image& image, int channels, const Look& look)
{
    const int index[3] = {indexOf(image.channels, "R"), indexOf(image.channels, "G"),
                          indexOf(image.channels, "B")};
    const int alpha_index = indexOf(image.channels, "A");
    const auto byte = [](float value) {
        return static_cast<unsigned char>(std::lround(255 * value));
    };
    std::vector<unsigned char> bytes;
    bytes.reserve(std::size_t(image.width) * image.height * channels);
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
            const float* p = image.pixel(x, y);
            const float alpha =
                alpha_index < 0 ? 1 : std::min(1.0f, std::max(0.0f, p[alpha_index]));
            const float divisor = channels == 4 && alpha > 0 ? alpha : 1;
            for (const int c : index)
                bytes.push_back(
                    byte(c < 0 ? 0 : srgbFromLinear(float(look.shown(p[c] / divisor)))));
            if (channels == 4) bytes.push_back(byte(alpha));
        }
    return bytes;
}

/// Returns true if no pixel's alpha would be written as less than 255.
bool isOpaque(const Image& image)
{
    const int alpha = indexOf(image.channels, "A");
    if (alpha < 0) return true;
    for (std::size_t i = alpha; i < image.pixels.size(); i += image.channels.size())
        if (image.pixels[i] < 1 - 0.5f / 255) return false;
    return true;
}

OIIO::ImageSpec specOf(const Image& image, bool exr, int channels,
                       const std::vector<std::pair<std::string, std::string>>& metadata)
{
    OIIO::ImageSpec spec(image.width, image.height, channels,
                         exr ? OIIO::TypeDesc::FLOAT : OIIO::TypeDesc::UINT8);
    if (exr) {
        spec.channelnames = image.channels;
        spec.attribute("compression", "zip");
        spec.attribute("oiio:ColorSpace", "Linear");
    } else {
        spec.attribute("oiio:ColorSpace", "sRGB");
        if (channels == 4) spec.attribute("oiio:UnassociatedAlpha", 1);
    }
    spec.alpha_channel = indexOf(spec.channelnames, "A");
    for (const auto& [name, value] : metadata) spec.attribute(name, value);
    return spec;
}

} // namespace

bool requirePictureName(const std::filesystem::path& file)
{
    std::string ending = file.extension().string();
    std::transform(ending.begin(), ending.end(), ending.begin(),
                   [](unsigned char c) { return char(std::tolower(c)); });
    if (ending != ".exr" && ending != ".png")
        throw fileError(file, "", "a picture's name that ends in .exr or .png", "'" + ending + "'");
    return ending == ".exr";
}

Image readImage(const std::filesystem::path& file)
{
    ImageFile found = readImageFile(file, StoredAlpha::multiply);
    Image image;
    image.width = found.width;
    image.height = found.height;
    image.channels = std::move(found.channels);
    if (found.data.width == image.width && found.data.height == image.height) {
        image.pixels = std::move(found.pixels);
        return image;
    }
    const std::size_t channels = image.channels.size();
    const double values = double(image.width) * image.height * double(channels);
    if (values > std::max(kMostBorder, 8.0 * double(found.pixels.size())))
        throw fileError(file, "", "pixels in most of the picture",
                        "a display window that is much larger than the data",
                        "Write the picture without cutting its border off.");
    image.pixels.assign(std::size_t(values), 0.0f);
    const std::size_t row = std::size_t(found.data.width) * channels;
    for (int y = 0; y < found.data.height; ++y)
        std::copy_n(found.pixels.begin() + std::ptrdiff_t(row * std::size_t(y)), row,
                    image.pixel(found.data.x, found.data.y + y));
    return image;
}

void writeImage(const std::filesystem::path& file, const Image& image,
                const std::vector<std::pair<std::string, std::string>>& metadata, const Look& look)
{
    const bool exr = requirePictureName(file);
    writeAtomically(file, [&](const std::filesystem::path& temporary) {
        const auto failed = [&](const std::string& why) {
            return fileError(file, "", "a file to write", why, "Is the disk full?");
        };
        // By the format's name, as create() takes ? in a file's name for the beginning of a query.
        const std::unique_ptr<OIIO::ImageOutput> out =
            OIIO::ImageOutput::create(exr ? "openexr" : "png");
        if (!out) throw failed("'" + OIIO::geterror() + "'");
        const int channels = exr ? int(image.channels.size()) : isOpaque(image) ? 3 : 4;
        const OIIO::ImageSpec spec = specOf(image, exr, channels, metadata);
        const bool written = out->open(temporary.string(), spec)
            && (exr ? out->write_image(OIIO::TypeDesc::FLOAT, image.pixels.data())
                    : out->write_image(OIIO::TypeDesc::UINT8,
                                       toBytes(image, channels, look).data()))
            && out->close();
        if (!written) throw failed("'" + out->geterror() + "'");
    });
}

} // namespace volcomp
