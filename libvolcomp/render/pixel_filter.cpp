// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/pixel_filter.h"

#include <algorithm>
#include <cmath>

#include "volcomp/base/random.h"

namespace volcomp {

double pixelRadius(const RenderParams& params)
{
    if (params.pixel_radius > 0) return params.pixel_radius;
    return params.pixel_filter == PixelFilter::box ? 0.5 : 1.5;
}

double pixelWeight(PixelFilter filter, double x)
{
    if (std::abs(x) > 1) return 0;
    switch (filter) {
    case PixelFilter::box:
        return 1;
    case PixelFilter::gaussian:
        return std::exp(-0.5 * 9 * x * x); // the radius is three standard deviations
    case PixelFilter::blackman_harris: {
        const double a = kPi * x; // Harris 1978, four terms
        return 0.35875 + 0.48829 * std::cos(a) + 0.14128 * std::cos(2 * a)
            + 0.01168 * std::cos(3 * a);
    }
    }
    return 0;
}

namespace {

/// Returns place `index` of a random order of 0 ... size - 1 that depends on the key alone: the
/// swap-or-not shuffle (Hoang, Morris, Rogaway: An Enciphering Scheme Based on a Card Shuffle,
/// CRYPTO 2012). Each round pairs every place with another one, and swaps half of the pairs.
std::uint32_t placeInOrder(std::uint32_t index, std::uint32_t size, std::uint64_t key)
{
    constexpr std::uint64_t kRounds = 16; // any place or pair is as likely up to 2^-16
    for (std::uint64_t round = 0; round < kRounds; ++round) {
        const std::uint64_t random = mix64(key + (round + 1) * 0x9e3779b97f4a7c15ULL);
        const auto sum = static_cast<std::uint32_t>((random >> 32) * size >> 32);
        const std::uint32_t partner = sum >= index ? sum - index : sum + size - index;
        if (mix64(random ^ std::max(index, partner)) & 1) index = partner;
    }
    return index;
}

} // namespace

PixelSampler::PixelSampler(const RenderParams& params)
    : m_samples(params.samples), m_side(int(std::sqrt(double(params.samples)) + 1e-9)),
      m_width(params.width), m_radius(pixelRadius(params))
{
    if (params.pixel_filter == PixelFilter::box) return;
    constexpr int kSteps = 4096, kEntries = 1024;
    std::vector<double> below{0}; // weight below each step, by the trapezium rule
    const auto weight = [&](int i) {
        return pixelWeight(params.pixel_filter, 2.0 * i / kSteps - 1);
    };
    for (int i = 0; i < kSteps; ++i)
        below.push_back(below.back() + 0.5 * (weight(i) + weight(i + 1)));
    for (int k = 0, i = 0; k <= kEntries; ++k) {
        const double u = below.back() * k / kEntries;
        while (i < kSteps - 1 && below[i + 1] < u) ++i;
        const double inside =
            below[i + 1] > below[i] ? std::min(1.0, (u - below[i]) / (below[i + 1] - below[i])) : 0;
        m_inverse.push_back(m_radius * (2 * (i + inside) / kSteps - 1));
    }
}

double PixelSampler::warp(double u) const
{
    if (m_inverse.empty()) return m_radius * (2 * u - 1);
    const double at = u * double(m_inverse.size() - 1);
    const std::size_t i = std::min(std::size_t(at), m_inverse.size() - 2);
    return m_inverse[i] + (at - double(i)) * (m_inverse[i + 1] - m_inverse[i]);
}

Vec3d PixelSampler::position(int x, int y, int sample) const
{
    if (m_samples == 1) return {x + 0.5, y + 0.5, 0};
    const std::uint64_t pixel = hashKey(0x5eed, std::uint64_t(y) * m_width + x);
    const int cells = m_side * m_side;
    // Each pixel takes the cells in an order of its own, so that the picture is not moved while
    // some are missing.
    const int place = sample < cells
        ? static_cast<int>(placeInOrder(std::uint32_t(sample), std::uint32_t(cells), pixel))
        : sample;
    Random random(hashKey(pixel, place));
    double u = random.uniform(), v = random.uniform();
    if (place < cells) {
        const int row = place / m_side, column = place % m_side;
        u = (column + u) / m_side;
        v = (row + v) / m_side;
    }
    if (m_inverse.empty() && m_radius == 0.5) return {x + u, y + v, 0};
    return {x + 0.5 + warp(u), y + 0.5 + warp(v), 0};
}

} // namespace volcomp
