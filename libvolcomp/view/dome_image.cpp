// SPDX-License-Identifier: Apache-2.0
#include "volcomp/view/dome_image.h"

#include <algorithm>
#include <cmath>
#include <string>

#include <fmt/format.h>

#include "volcomp/base/error.h"
#include "volcomp/base/image_file.h"

namespace volcomp {
namespace {

/// Most texels of an image whose display window is more than its data.
constexpr double kMostBorder = 1e8;
constexpr int kCoarseHeight = 32; ///< texels of 5.6 degrees

/// Which channels are red, green and blue.
struct Colours {
    std::size_t channel[3];
};

Colours coloursOf(const std::filesystem::path& file, const ImageFile& image)
{
    std::vector<std::size_t> colours;
    std::string names;
    for (std::size_t c = 0; c < image.channels.size(); ++c) {
        if (int(c) != image.alpha_channel) colours.push_back(c);
        names += (c ? ", " : "") + image.channels[c];
    }
    if (colours.size() == 1) return {{colours[0], colours[0], colours[0]}};
    if (colours.size() < 3)
        throw fileError(file, "", "one channel (grey) or red, green and blue",
                        fmt::format("{} ({})", image.channels.size(), names),
                        "Save it as a picture of colours.");
    Colours rgb{{colours[0], colours[1], colours[2]}};
    for (std::size_t k = 0; k < 3; ++k)
        for (const std::size_t c : colours)
            if (image.channels[c] == std::string(1, "RGB"[k])) rgb.channel[k] = c;
    return rgb;
}

void checkValues(const std::filesystem::path& file, const ImageFile& image, const Colours& rgb)
{
    const std::size_t channels = image.channels.size(), width = std::size_t(image.data.width);
    for (std::size_t p = 0; p * channels < image.pixels.size(); ++p)
        for (const std::size_t c : rgb.channel) {
            const float x = image.pixels[p * channels + c];
            if (x >= 0 && std::isfinite(x)) continue;
            throw fileError(
                file,
                fmt::format("pixel ({}, {})", image.data.x + p % width, image.data.y + p / width),
                "finite values >= 0",
                std::isnan(x)       ? "NaN"
                    : std::isinf(x) ? "infinity"
                                    : fmt::format("{:g}", x),
                "Mend it in a program for pictures.");
        }
}

} // namespace

double DomeImage::solidAngle(int row) const
{
    const double per_row = kPi / height;
    return 2 * kPi / width * (std::cos(row * per_row) - std::cos((row + 1) * per_row));
}

Vec3d DomeImage::direction(double x, double y) const
{
    const double around = 2 * kPi * (x / width - 0.5), down = kPi * y / height;
    return {std::sin(down) * std::sin(around), std::cos(down), -std::sin(down) * std::cos(around)};
}

Vec3d DomeImage::at(const Vec3d& d, bool with_suns) const
{
    const double across = std::hypot(d[0], d[2]);
    const double x = width * (0.5 + (across > 0 ? std::atan2(d[0], -d[2]) / (2 * kPi) : 0)) - 0.5,
                 y = height * (0.5 - std::atan2(d[1], across) / kPi) - 0.5;
    const double x0 = std::floor(x), y0 = std::floor(y);
    const auto texel = [&](int i, int j) {
        const std::size_t place = placeOf(((int(x0) + i) % width + width) % width,
                                          std::clamp(int(y0) + j, 0, height - 1));
        if (with_suns && !suns.empty()) {
            const auto sun = std::lower_bound(
                suns.begin(), suns.end(), place,
                [](const auto& known, std::size_t wanted) { return known.first < wanted; });
            if (sun != suns.end() && sun->first == place) return Vec3d(sun->second);
        }
        return Vec3d(texels[place]);
    };
    const double u = x - x0, v = y - y0;
    return (1 - v) * ((1 - u) * texel(0, 0) + u * texel(1, 0))
        + v * ((1 - u) * texel(0, 1) + u * texel(1, 1));
}

DomeImage readDomeImage(const std::filesystem::path& file)
{
    ImageFile image = readImageFile(file, StoredAlpha::keep);
    if (image.width != 2 * std::int64_t(image.height))
        throw fileError(file, "", "an image all around, twice as wide as high",
                        fmt::format("{} x {} pixels", image.width, image.height),
                        "Save it as a lat-long (equirectangular) panorama.");
    const double texels = double(image.width) * image.height;
    if (texels > std::max(kMostBorder, 8.0 * double(image.pixels.size())))
        throw fileError(file, "", "pixels in most of the picture",
                        "a display window that is much larger than the data",
                        "Write the picture without cutting its border off.");
    const Colours rgb = coloursOf(file, image);
    checkValues(file, image, rgb);
    makeLinear(image);
    DomeImage dome;
    dome.width = image.width;
    dome.height = image.height;
    dome.texels.resize(std::size_t(image.width) * image.height, Vec3f(0.0f));
    const float* value = image.pixels.data();
    for (int y = 0; y < image.data.height; ++y)
        for (int x = 0; x < image.data.width; ++x, value += image.channels.size()) {
            const Vec3f colour(value[rgb.channel[0]], value[rgb.channel[1]], value[rgb.channel[2]]);
            dome.texels[dome.placeOf(image.data.x + x, image.data.y + y)] = colour;
            dome.black = dome.black && colour == Vec3f(0.0f);
        }
    return dome;
}

DomeImage coarseDome(const DomeImage& image)
{
    if (image.height <= kCoarseHeight) return image;
    DomeImage coarse;
    coarse.height = kCoarseHeight;
    coarse.width = 2 * kCoarseHeight;
    coarse.black = image.black;
    const std::size_t cells = std::size_t(coarse.width) * coarse.height;
    std::vector<Vec3d> sums(cells, Vec3d(0.0));
    std::vector<double> weights(cells, 0.0);
    for (int y = 0; y < image.height; ++y) {
        const double weight = image.solidAngle(y);
        const auto row = int(std::int64_t(y) * coarse.height / image.height);
        for (int x = 0; x < image.width; ++x) {
            const std::size_t cell =
                coarse.placeOf(int(std::int64_t(x) * coarse.width / image.width), row);
            sums[cell] += weight * Vec3d(image.texels[image.placeOf(x, y)]);
            weights[cell] += weight;
        }
    }
    for (std::size_t i = 0; i < cells; ++i) coarse.texels.emplace_back(sums[i] / weights[i]);
    return coarse;
}

} // namespace volcomp
