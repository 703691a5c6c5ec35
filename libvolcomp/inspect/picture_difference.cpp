// SPDX-License-Identifier: Apache-2.0
#include "volcomp/inspect/picture_difference.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <fmt/format.h>

#include "volcomp/base/error.h"
#include "volcomp/inspect/panel.h"

namespace volcomp {
namespace {

/// The place of a channel. Throws Error if there is none.
std::size_t channelOf(const Image& image, const std::string& name)
{
    const auto at = std::find(image.channels.begin(), image.channels.end(), name);
    if (at == image.channels.end())
        throw Error("expected a picture with a channel '" + name + "', found none");
    return std::size_t(at - image.channels.begin());
}

/// A picture's R, G and B, row by row.
std::vector<Vec3f> colours(const Image& image)
{
    const std::size_t channels[3] = {channelOf(image, "R"), channelOf(image, "G"),
                                     channelOf(image, "B")};
    std::vector<Vec3f> result(std::size_t(image.width) * image.height);
    for (std::size_t i = 0; i < result.size(); ++i)
        for (int c = 0; c < 3; ++c)
            result[i][c] = image.pixels[i * image.channels.size() + channels[c]];
    return result;
}

void requireSameSize(const Image& a, const Image& b)
{
    if (a.width == b.width && a.height == b.height) return;
    throw Error(fmt::format("expected two pictures of one size, found {} x {} and {} x {} pixels",
                            a.width, a.height, b.width, b.height));
}

/// Means over the blocks that lie wholly in the picture.
std::vector<Vec3d> blockMeans(const std::vector<Vec3f>& pixels, int width, int height, int block)
{
    const int across = width / block, down = height / block;
    std::vector<Vec3d> means(std::size_t(across) * down, Vec3d(0.0));
    for (int y = 0; y < down * block; ++y)
        for (int x = 0; x < across * block; ++x)
            means[std::size_t(y / block) * across + x / block] +=
                Vec3d(pixels[std::size_t(y) * width + x]) / double(block * block);
    return means;
}

template <class V>
double rootMeanSquare(const std::vector<V>& a, const std::vector<V>& b)
{
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += Vec3d(a[i] - b[i]).lengthSqr();
    return a.empty() ? 0 : std::sqrt(sum / (3 * double(a.size())));
}

double meanOf(const std::vector<Vec3f>& pixels)
{
    double sum = 0;
    for (const Vec3f& p : pixels) sum += double(p[0]) + p[1] + p[2];
    return pixels.empty() ? 0 : sum / (3 * double(pixels.size()));
}

double alphaDifference(const Image& a, const Image& b)
{
    const auto has = [](const Image& image) {
        return std::find(image.channels.begin(), image.channels.end(), "A") != image.channels.end();
    };
    if (!has(a) || !has(b)) return 0;
    const std::size_t in_a = channelOf(a, "A"), in_b = channelOf(b, "A");
    const std::size_t count = std::size_t(a.width) * a.height;
    double sum = 0;
    for (std::size_t i = 0; i < count; ++i) {
        const double d =
            double(a.pixels[i * a.channels.size() + in_a]) - b.pixels[i * b.channels.size() + in_b];
        sum += d * d;
    }
    return count == 0 ? 0 : std::sqrt(sum / double(count));
}

/// How far two colours are from each other.
double distance(const Vec3f& a, const Vec3f& b) { return std::sqrt(Vec3d(a - b).lengthSqr() / 3); }

std::vector<DifferentPixel> worstOf(const std::vector<Vec3f>& a, const std::vector<Vec3f>& b,
                                    int width, int count)
{
    constexpr int kApart = 12;          // pixels
    constexpr std::size_t kMost = 5000; // looked at
    std::vector<std::size_t> order(a.size());
    std::iota(order.begin(), order.end(), std::size_t(0));
    const auto worse = [&](std::size_t i, std::size_t j) {
        const double di = distance(a[i], b[i]), dj = distance(a[j], b[j]);
        return di > dj || (di == dj && i < j);
    };
    const auto looked_at = std::min(order.size(), kMost);
    std::partial_sort(order.begin(), order.begin() + std::ptrdiff_t(looked_at), order.end(), worse);
    std::vector<DifferentPixel> worst;
    for (std::size_t k = 0; k < looked_at && int(worst.size()) < count; ++k) {
        const std::size_t i = order[k];
        DifferentPixel p{
            int(i % std::size_t(width)), int(i / std::size_t(width)), {}, {}, distance(a[i], b[i])};
        if (!(p.difference > 0)) break;
        const auto near_by = [&](const DifferentPixel& other) {
            return std::max(std::abs(other.x - p.x), std::abs(other.y - p.y)) < kApart;
        };
        if (std::any_of(worst.begin(), worst.end(), near_by)) continue;
        std::copy_n(a[i].asPointer(), 3, p.a);
        std::copy_n(b[i].asPointer(), 3, p.b);
        worst.push_back(p);
    }
    return worst;
}

/// The factor with which one pixel in 1000 is at 1 or above; 1 if the pictures are equal.
double gainFor(const std::vector<Vec3f>& a, const std::vector<Vec3f>& b)
{
    std::vector<double> differences(a.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
        const Vec3f d = a[i] - b[i];
        differences[i] = std::abs(double(d[0]) + d[1] + d[2]) / 3;
    }
    if (differences.empty()) return 1;
    const auto at = differences.begin() + std::ptrdiff_t(differences.size() * 999 / 1000);
    std::nth_element(differences.begin(), at, differences.end());
    const double most = *at > 0 ? *at : *std::max_element(differences.begin(), differences.end());
    return most > 0 ? 1 / most : 1;
}

/// Red where A is brighter, blue where B is, black where they are equal.
Vec3f shown(const Vec3f& a, const Vec3f& b, double gain)
{
    const Vec3f d = a - b;
    const double x = std::clamp(gain * (double(d[0]) + d[1] + d[2]) / 3, -1.0, 1.0);
    const auto s = float(std::abs(x));
    return x > 0 ? Vec3f(s, 0.25f * s * s, 0.05f * s) : Vec3f(0.1f * s, 0.35f * s, s);
}

void paste(Image& image, int left, int top, int width, const std::vector<Vec3f>& pixels)
{
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        float* out =
            image.pixel(left + int(i % std::size_t(width)), top + int(i / std::size_t(width)));
        for (int c = 0; c < 3; ++c) out[c] = pixels[i][c];
    }
}

/// A square around a pixel, with a dark line around it.
void mark(Image& image, int left, int top, int width, int height, const DifferentPixel& p)
{
    constexpr int kHalf = 6;
    for (int j = -kHalf; j <= kHalf; ++j)
        for (int i = -kHalf; i <= kHalf; ++i) {
            const int edge = std::max(std::abs(i), std::abs(j)), x = p.x + i, y = p.y + j;
            if (edge < kHalf - 1 || x < 0 || y < 0 || x >= width || y >= height) continue;
            for (int c = 0; c < 3; ++c)
                image.pixel(left + x, top + y)[c] = edge == kHalf ? 0.0f : 0.9f * float(c != 2);
        }
}

} // namespace

PictureDifference differenceOf(const Image& a, const Image& b, int block, int worst)
{
    requireSameSize(a, b);
    const std::vector<Vec3f> pixels_a = colours(a), pixels_b = colours(b);
    PictureDifference d;
    d.mean_a = meanOf(pixels_a);
    d.mean_b = meanOf(pixels_b);
    const double unit = d.mean_b > 0 ? d.mean_b : 1;
    d.bias = (d.mean_a - d.mean_b) / unit;
    d.rmse = rootMeanSquare(pixels_a, pixels_b) / unit;
    d.block_rmse = rootMeanSquare(blockMeans(pixels_a, a.width, a.height, block),
                                  blockMeans(pixels_b, b.width, b.height, block))
        / unit;
    d.alpha_rmse = alphaDifference(a, b);
    d.worst = worstOf(pixels_a, pixels_b, a.width, worst);
    d.equal = pixels_a == pixels_b && d.alpha_rmse == 0;
    return d;
}

Image differencePicture(const Image& a, const Image& b, const std::string& name_a,
                        const std::string& name_b, double gain)
{
    requireSameSize(a, b);
    const std::vector<Vec3f> pixels_a = colours(a), pixels_b = colours(b);
    if (!(gain > 0)) gain = gainFor(pixels_a, pixels_b);
    std::vector<Vec3f> difference(pixels_a.size());
    for (std::size_t i = 0; i < difference.size(); ++i)
        difference[i] = shown(pixels_a[i], pixels_b[i], gain);
    constexpr int kGap = 4;
    const int font = std::clamp(a.height / 24, 10, 18), strip = font * 2;
    Image image;
    image.width = 3 * a.width + 2 * kGap;
    image.height = a.height + strip;
    image.channels = {"R", "G", "B"};
    image.pixels.assign(std::size_t(image.width) * image.height * 3, 0.03f);
    paste(image, 0, strip, a.width, pixels_a);
    paste(image, a.width + kGap, strip, a.width, pixels_b);
    const int left = 2 * (a.width + kGap);
    paste(image, left, strip, a.width, difference);
    for (const DifferentPixel& p : worstOf(pixels_a, pixels_b, a.width, 5))
        mark(image, left, strip, a.width, a.height, p);
    const int y = strip - font / 2;
    writeText(image, font / 2, y, font, {name_a});
    writeText(image, a.width + kGap + font / 2, y, font, {name_b});
    writeText(image, left + font / 2, y, font,
              {fmt::format("A - B x {:.3g}: red A, blue B is brighter", gain)});
    return image;
}

} // namespace volcomp
