// SPDX-License-Identifier: Apache-2.0
#include "volcomp/surface/texture.h"

#include <cmath>

#include <OpenImageIO/imageio.h>
#include <fmt/format.h>

#include "volcomp/base/error.h"
#include "volcomp/base/plain_name.h"
#include "volcomp/base/srgb.h"

namespace volcomp {
namespace {

/// Index of the pixel that the wrap mode shows at `x`; -1: black.
int wrapped(std::int64_t x, int size, Wrap mode)
{
    if (x >= 0 && x < size) return static_cast<int>(x);
    switch (mode) {
    case Wrap::clamp:
        return x < 0 ? 0 : size - 1;
    case Wrap::black:
        return -1;
    case Wrap::repeat:
        return static_cast<int>((x % size + size) % size);
    case Wrap::mirror: {
        const std::int64_t period = 2 * std::int64_t(size), y = (x % period + period) % period;
        return static_cast<int>(y < size ? y : period - 1 - y);
    }
    }
    return -1;
}

} // namespace

float Texture::sample(double u, double v, int channel, Wrap wrap) const
{
    if (channel >= channels) {
        if (channel == 3) return 1;
        channel = 0;
    }
    if (!(std::abs(u) < 1e9 && std::abs(v) < 1e9)) return 0;
    const double x = u * width - 0.5, y = (1 - v) * height - 0.5;
    const double x0 = std::floor(x), y0 = std::floor(y);
    const auto at = [&](double i, double j) {
        const int column = wrapped(static_cast<std::int64_t>(i), width, wrap),
                  row = wrapped(static_cast<std::int64_t>(j), height, wrap);
        return column < 0 || row < 0
            ? 0.0f
            : pixels[(static_cast<std::size_t>(row) * width + column) * channels + channel];
    };
    const auto fx = static_cast<float>(x - x0), fy = static_cast<float>(y - y0);
    const float top = at(x0, y0) * (1 - fx) + at(x0 + 1, y0) * fx;
    const float bottom = at(x0, y0 + 1) * (1 - fx) + at(x0 + 1, y0 + 1) * fx;
    return top * (1 - fy) + bottom * fy;
}

Vec3f Texture::colour(double u, double v, Wrap wrap) const
{
    if (!(std::abs(u) < 1e9 && std::abs(v) < 1e9)) return Vec3f(0.0f);
    const double x = u * width - 0.5, y = (1 - v) * height - 0.5;
    const double x0 = std::floor(x), y0 = std::floor(y);
    const auto fx = static_cast<float>(x - x0), fy = static_cast<float>(y - y0);
    const int columns[2] = {wrapped(static_cast<std::int64_t>(x0), width, wrap),
                            wrapped(static_cast<std::int64_t>(x0) + 1, width, wrap)};
    const int rows[2] = {wrapped(static_cast<std::int64_t>(y0), height, wrap),
                         wrapped(static_cast<std::int64_t>(y0) + 1, height, wrap)};
    const int green = channels < 3 ? 0 : 1, blue = channels < 3 ? 0 : 2;
    Vec3f sum(0.0f);
    for (int j = 0; j < 2; ++j)
        for (int i = 0; i < 2; ++i) {
            if (rows[j] < 0 || columns[i] < 0) continue;
            const float* p =
                &pixels[(static_cast<std::size_t>(rows[j]) * width + columns[i]) * channels];
            sum += Vec3f(p[0], p[green], p[blue]) * ((i ? fx : 1 - fx) * (j ? fy : 1 - fy));
        }
    return sum;
}

Texture readTexture(const std::filesystem::path& file, bool to_linear)
{
    const char* expected = "an image that OpenImageIO reads (PNG, EXR, TIFF, JPEG, ...)";
    std::error_code code;
    if (!std::filesystem::is_regular_file(file, code))
        throw fileError(file, "", expected, "no file", "Check the path.");
    if (std::filesystem::file_size(file, code) == 0)
        throw fileError(file, "", expected, "an empty file");
    OIIO::ImageSpec wish;
    wish.attribute("oiio:UnassociatedAlpha", 1);
    const PlainName name(file);
    const auto input = OIIO::ImageInput::open(name.text(), &wish);
    if (!input) throw fileError(file, "", expected, "something else: " + OIIO::geterror());
    const OIIO::ImageSpec spec = input->spec();
    Texture t;
    t.width = spec.width;
    t.height = spec.height;
    t.channels = spec.nchannels;
    if (spec.width < 1 || spec.height < 1 || spec.depth > 1 || spec.nchannels < 1)
        throw fileError(file, "", "a flat image",
                        fmt::format("{} x {} x {} pixels", spec.width, spec.height, spec.depth));
    if (double(spec.width) * spec.height * spec.nchannels > 4e9)
        throw fileError(file, "", "an image of at most 4e9 values", "more", "Make it smaller.");
    t.pixels.resize(static_cast<std::size_t>(t.width) * t.height * t.channels);
    if (!input->read_image(0, 0, 0, t.channels, OIIO::TypeDesc::FLOAT, t.pixels.data()))
        throw fileError(file, "", "a complete image", "a broken one: " + input->geterror(),
                        "Is the file complete?");
    for (std::size_t i = 0; i < t.pixels.size(); ++i)
        if (!std::isfinite(t.pixels[i])) {
            const std::size_t p = i / t.channels;
            throw fileError(file, fmt::format("pixel ({}, {})", p % t.width, p / t.width),
                            "finite values", "NaN or infinity");
        }
    const bool srgb = spec.get_string_attribute("oiio:ColorSpace") == "sRGB"
        || spec.format == OIIO::TypeDesc::UINT8;
    if (to_linear && srgb)
        for (std::size_t i = 0; i < t.pixels.size(); ++i) {
            if (static_cast<int>(i % t.channels) == spec.alpha_channel) continue;
            float& x = t.pixels[i];
            x = linearFromSrgb(x);
        }
    return t;
}

} // namespace volcomp
