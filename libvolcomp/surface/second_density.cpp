// SPDX-License-Identifier: Apache-2.0
#include "volcomp/surface/second_density.h"

#include <algorithm>
#include <cmath>

#include "volcomp/base/error.h"
#include "volcomp/base/random.h"

namespace volcomp {
namespace {

double fade(double t) { return t * t * t * (t * (t * 6 - 15) + 10); }

/// One octave; returns about -1 to 1.
double perlin(const Vec3d& p, std::uint64_t seed)
{
    const double cell[3] = {std::floor(p[0]), std::floor(p[1]), std::floor(p[2])};
    // Where many octaves lie further away than whole numbers reach, they are 0.
    const auto whole = [](double x) {
        return static_cast<std::int64_t>(std::clamp(x, -9e18, 9e18));
    };
    const double f[3] = {p[0] - cell[0], p[1] - cell[1], p[2] - cell[2]};
    const double w[3] = {fade(f[0]), fade(f[1]), fade(f[2])};
    double sum = 0;
    for (int corner = 0; corner < 8; ++corner) {
        std::uint64_t key = seed;
        double weight = 1, d[3];
        for (int i = 0; i < 3; ++i) {
            const int bit = corner >> i & 1;
            key = hashKey(key, static_cast<std::uint64_t>(whole(cell[i]) + bit));
            weight *= bit ? w[i] : 1 - w[i];
            d[i] = f[i] - bit;
        }
        // The gradient points to the middle of one of a cube's twelve edges.
        const int edge = static_cast<int>(key >> 60) % 12;
        const double a = edge < 8 ? d[0] : d[1], b = edge < 4 ? d[1] : d[2];
        sum += weight * ((edge & 1 ? -a : a) + (edge & 2 ? -b : b));
    }
    return sum;
}

/// Whether the image, which is taken as a colour, is not opaque everywhere.
bool isCut(const Texture& t, Wrap wrap)
{
    constexpr int kAlpha = 3; // red, green, blue, alpha
    if (t.channels <= kAlpha) return false;
    if (wrap == Wrap::black || t.data.width < t.width || t.data.height < t.height) return true;
    for (std::size_t i = kAlpha; i < t.pixels.size(); i += std::size_t(t.channels))
        if (t.pixels[i] < 1) return true;
    return false;
}

} // namespace

double gradientNoise(const Vec3d& p, int octaves, std::uint64_t seed)
{
    if (!(std::abs(p[0]) + std::abs(p[1]) + std::abs(p[2]) < 1e15)) return 0.5;
    double sum = 0, total = 0, strength = 1;
    Vec3d q = p;
    for (int k = 0; k < octaves; ++k) {
        sum += strength * perlin(q, hashKey(seed, static_cast<std::uint64_t>(k)));
        total += strength;
        strength /= 2;
        q *= 2.0;
    }
    return std::clamp(0.5 + 0.5 * sum / total, 0.0, 1.0);
}

void MapFactor::validate() const
{
    if (!image.empty() && noise > 0)
        throw Error(
            "map: expected an image or noise, found both in one factor; write them as two factors");
    if (!(noise >= 0) || octaves < 1 || octaves > 16 || channel < -1
        || !std::isfinite(low + high + noise + repeat[0] + repeat[1] + constant.lengthSqr()))
        throw Error("map: expected finite numbers, noise >= 0 and 1 to 16 octaves");
}

SecondDensity::SecondDensity(const std::vector<MapFactor>& factors, bool colour)
{
    for (const MapFactor& spec : factors) {
        spec.validate();
        Factor f{spec, nullptr, false};
        if (!spec.image.empty()) {
            auto texture = std::make_shared<Texture>(readTexture(spec.image, colour));
            if (spec.channel >= texture->channels)
                throw fileError(spec.image, "", "channel " + std::to_string(spec.channel),
                                std::to_string(texture->channels) + " channels",
                                "They count from 0.");
            f.texture = std::move(texture);
            f.has_alpha = colour && spec.channel < 0 && isCut(*f.texture, spec.wrap);
        }
        m_factors.push_back(std::move(f));
    }
}

bool SecondDensity::isConstant() const
{
    return std::all_of(m_factors.begin(), m_factors.end(),
                       [](const Factor& f) { return !f.texture && f.spec.noise == 0; });
}

bool SecondDensity::usesUv() const
{
    return std::any_of(m_factors.begin(), m_factors.end(),
                       [](const Factor& f) { return f.texture != nullptr; });
}

bool SecondDensity::hasAlpha() const
{
    return std::any_of(m_factors.begin(), m_factors.end(),
                       [](const Factor& f) { return f.has_alpha; });
}

float SecondDensity::alpha(const Vec2d& uv) const
{
    float product = 1;
    for (const Factor& f : m_factors)
        if (f.has_alpha)
            product *= f.texture->sample(uv[0] * f.spec.repeat[0], uv[1] * f.spec.repeat[1], 3,
                                         f.spec.wrap);
    return product;
}

float SecondDensity::value(const Vec2d& uv, const Vec3d& p) const
{
    double product = 1;
    for (const auto& [spec, texture, has_alpha] : m_factors) {
        if (texture) {
            const double u = uv[0] * spec.repeat[0], v = uv[1] * spec.repeat[1];
            double x;
            if (spec.channel >= 0 || texture->channels < 3)
                x = texture->sample(u, v, std::max(0, spec.channel), spec.wrap);
            else
                x = 0.2126 * texture->sample(u, v, 0, spec.wrap)
                    + 0.7152 * texture->sample(u, v, 1, spec.wrap)
                    + 0.0722 * texture->sample(u, v, 2, spec.wrap);
            product *= spec.low + (spec.high - spec.low) * x;
        } else if (spec.noise > 0)
            product *= spec.low
                + (spec.high - spec.low) * gradientNoise(p / spec.noise, spec.octaves, spec.seed);
        else product *= spec.constant[0];
    }
    return static_cast<float>(product);
}

Vec3f SecondDensity::colour(const Vec2d& uv, const Vec3d& p) const
{
    Vec3d product(1.0);
    for (const auto& [spec, texture, has_alpha] : m_factors) {
        const auto ranged = [&, low = spec.low, high = spec.high](double x) {
            return low + (high - low) * x;
        };
        if (texture) {
            const double u = uv[0] * spec.repeat[0], v = uv[1] * spec.repeat[1];
            const Vec3f c = spec.channel >= 0
                ? Vec3f(texture->sample(u, v, spec.channel, spec.wrap))
                : texture->colour(u, v, spec.wrap);
            for (int i = 0; i < 3; ++i) product[i] *= ranged(c[i]);
        } else if (spec.noise > 0)
            product *= ranged(gradientNoise(p / spec.noise, spec.octaves, spec.seed));
        else product *= spec.constant;
    }
    return Vec3f(product);
}

} // namespace volcomp
