#include "volcomp/view/image.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include <OpenImageIO/imageio.h>

#include "volcomp/base/atomic_file.h"
#include "volcomp/base/error.h"

namespace volcomp {
namespace {

float toSrgb(float x)
{
    x = std::min(1.0f, std::max(0.0f, x)); // NaN becomes 0
    return x <= 0.0031308f ? 12.92f * x : 1.055f * std::pow(x, 1 / 2.4f) - 0.055f;
}

// R, G, B and A as bytes. PNG keeps colours that alpha has not multiplied.
std::vector<unsigned char> toBytes(const Image& image, int channels)
{
    int index[4] = {-1, -1, -1, -1};
    const char* names[4] = {"R", "G", "B", "A"};
    for (int c = 0; c < 4; ++c)
        for (std::size_t i = 0; i < image.channels.size(); ++i)
            if (image.channels[i] == names[c]) index[c] = int(i);
    std::vector<unsigned char> bytes;
    bytes.reserve(std::size_t(image.width) * image.height * channels);
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
            const float* p = image.pixel(x, y);
            const float alpha = index[3] < 0 ? 1 : std::min(1.0f, std::max(0.0f, p[index[3]]));
            for (int c = 0; c < channels; ++c) {
                const float value = c == 3 ? alpha
                    : index[c] < 0
                    ? 0
                    : toSrgb(channels == 4 && alpha > 0 ? p[index[c]] / alpha : p[index[c]]);
                bytes.push_back(static_cast<unsigned char>(std::lround(255 * value)));
            }
        }
    return bytes;
}

bool isOpaque(const Image& image)
{
    const auto alpha = std::find(image.channels.begin(), image.channels.end(), "A");
    if (alpha == image.channels.end()) return true;
    for (std::size_t i = alpha - image.channels.begin(); i < image.pixels.size();
         i += image.channels.size())
        if (image.pixels[i] < 1 - 0.5f / 255) return false;
    return true;
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
    const std::unique_ptr<OIIO::ImageInput> in = OIIO::ImageInput::open(file.string());
    if (!in) throw fileError(file, "", "a picture", "'" + OIIO::geterror() + "'");
    Image image;
    image.width = in->spec().width;
    image.height = in->spec().height;
    image.channels = in->spec().channelnames;
    image.pixels.resize(image.channels.size() * image.width * image.height);
    if (!in->read_image(0, 0, 0, -1, OIIO::TypeDesc::FLOAT, image.pixels.data()))
        throw fileError(file, "", "a complete picture", "'" + in->geterror() + "'");
    return image;
}

void writeImage(const std::filesystem::path& file, const Image& image,
                const std::vector<std::pair<std::string, std::string>>& metadata)
{
    const bool exr = requirePictureName(file);
    writeAtomically(file, [&](const std::filesystem::path& temporary) {
        const auto failed = [&](const std::string& why) {
            return fileError(file, "", "a file to write", why, "Is the disk full?");
        };
        const std::unique_ptr<OIIO::ImageOutput> out =
            OIIO::ImageOutput::create(temporary.string());
        if (!out) throw failed("'" + OIIO::geterror() + "'");
        const int channels = exr ? int(image.channels.size()) : isOpaque(image) ? 3 : 4;
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
        const auto alpha = std::find(spec.channelnames.begin(), spec.channelnames.end(), "A");
        spec.alpha_channel =
            alpha == spec.channelnames.end() ? -1 : int(alpha - spec.channelnames.begin());
        for (const auto& [name, value] : metadata) spec.attribute(name, value);
        const bool written = out->open(temporary.string(), spec)
            && (exr ? out->write_image(OIIO::TypeDesc::FLOAT, image.pixels.data())
                    : out->write_image(OIIO::TypeDesc::UINT8, toBytes(image, channels).data()))
            && out->close();
        if (!written) throw failed("'" + out->geterror() + "'");
    });
}

} // namespace volcomp
