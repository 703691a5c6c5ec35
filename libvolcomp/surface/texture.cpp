// SPDX-License-Identifier: Apache-2.0
#include "volcomp/surface/texture.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "volcomp/base/error.h"

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

/// Place of a pixel of the picture in Texture::pixels; nothing where the file has none. (-1 is
/// black.)
std::optional<std::size_t> placeOf(const Texture& t, int column, int row)
{
    const int x = column - t.data.x, y = row - t.data.y;
    if (column < 0 || row < 0 || x < 0 || y < 0 || x >= t.data.width || y >= t.data.height)
        return std::nullopt;
    return (static_cast<std::size_t>(y) * t.data.width + x) * t.channels;
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
        const auto place = placeOf(*this, column, row);
        return place ? pixels[*place + channel] : 0.0f;
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
            const auto place = placeOf(*this, columns[i], rows[j]);
            if (!place) continue;
            const float* p = &pixels[*place];
            sum += Vec3f(p[0], p[green], p[blue]) * ((i ? fx : 1 - fx) * (j ? fy : 1 - fy));
        }
    return sum;
}

namespace {

Texture asTexture(const std::filesystem::path& file, ImageFile image, bool to_linear)
{
    const std::size_t channels = image.channels.size();
    for (std::size_t i = 0; i < image.pixels.size(); ++i)
        if (!std::isfinite(image.pixels[i])) {
            const std::size_t p = i / channels, width = image.data.width;
            throw fileError(
                file,
                fmt::format("pixel ({}, {})", image.data.x + p % width, image.data.y + p / width),
                "finite values", "NaN or infinity");
        }
    if (to_linear) makeLinear(image);
    Texture t;
    t.width = image.width;
    t.height = image.height;
    t.channels = static_cast<int>(channels);
    t.data = image.data;
    t.pixels = std::move(image.pixels);
    return t;
}

} // namespace

Texture readTexture(const std::filesystem::path& file, bool to_linear)
{
    return asTexture(file, readImageFile(file, StoredAlpha::keep), to_linear);
}

Texture readTexture(const std::filesystem::path& file, std::string_view bytes, bool to_linear)
{
    return asTexture(file, readImageBytes(file, bytes, StoredAlpha::keep), to_linear);
}

} // namespace volcomp
