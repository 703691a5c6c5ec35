// SPDX-License-Identifier: Apache-2.0
#include "tools/shared/picture_error.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "volcomp/base/error.h"

namespace volcomp {
namespace {

/// The mean of a channel over blocks of `size` pixels; what does not fill a block is left out.
std::vector<double> blockMeans(const Image& image, const std::string& channel, int size)
{
    const auto at = std::find(image.channels.begin(), image.channels.end(), channel);
    if (at == image.channels.end())
        throw Error("expected a picture with a channel '" + channel + "', found none");
    const auto c = at - image.channels.begin();
    const int w = image.width / size, h = image.height / size;
    std::vector<double> means(std::size_t(w) * h);
    for (int y = 0; y < h * size; ++y)
        for (int x = 0; x < w * size; ++x)
            means[std::size_t(y / size) * w + x / size] +=
                image.pixel(x, y)[c] / double(size * size);
    return means;
}

struct Difference {
    double mean = 0, bias = 0, square = 0, count = 0;

    void add(double x, double exact, double half)
    {
        const double other = 2 * exact - half; // the picture of the other half of the samples
        mean += exact;
        bias += x - exact;
        square += (x - half) * (x - other);
        ++count;
    }
    double rmse() const
    {
        return count > 0 ? std::copysign(std::sqrt(std::abs(square) / count), square) : 0;
    }
};

Difference colourDifference(const Image& picture, const Image& exact, int size)
{
    Difference d;
    for (const char* channel : {"R", "G", "B"}) {
        const auto x = blockMeans(picture, channel, size), e = blockMeans(exact, channel, size),
                   half = blockMeans(exact, std::string("half.") + channel, size);
        for (std::size_t i = 0; i < x.size(); ++i) d.add(x[i], e[i], half[i]);
    }
    return d;
}

Difference alphaDifference(const Image& picture, const Image& exact, int size)
{
    Difference d;
    const auto x = blockMeans(picture, "A", size), e = blockMeans(exact, "A", size),
               half = blockMeans(exact, "half.A", size);
    for (std::size_t i = 0; i < x.size(); ++i)
        if (e[i] > 0 || x[i] > 1e-3) d.add(x[i], e[i], half[i]);
    return d;
}

} // namespace

PictureError pictureError(const Image& picture, const Image& exact, int block)
{
    if (picture.width != exact.width || picture.height != exact.height)
        throw Error("expected a picture of " + std::to_string(exact.width) + " x "
                    + std::to_string(exact.height) + " pixels, found "
                    + std::to_string(picture.width) + " x " + std::to_string(picture.height));
    const Difference pixels = colourDifference(picture, exact, 1),
                     blocks = colourDifference(picture, exact, block),
                     alpha = alphaDifference(picture, exact, 1),
                     alpha_blocks = alphaDifference(picture, exact, block);
    PictureError e;
    e.mean = pixels.mean / std::max(1.0, pixels.count);
    if (!(e.mean > 0)) throw Error("expected an exact picture that is not black");
    e.bias = pixels.bias / pixels.mean;
    e.rmse = pixels.rmse() / e.mean;
    e.block_rmse = blocks.rmse() / e.mean;
    e.alpha_mean = alpha.count > 0 ? alpha.mean / alpha.count : 0;
    e.alpha_bias = alpha.count > 0 ? alpha.bias / alpha.count : 0;
    e.alpha_rmse = alpha.rmse();
    e.alpha_block_rmse = alpha_blocks.rmse();
    return e;
}

nlohmann::json toJson(const PictureError& e)
{
    return {{"mean", e.mean},
            {"bias", e.bias},
            {"rmse", e.rmse},
            {"block_rmse", e.block_rmse},
            {"alpha_mean", e.alpha_mean},
            {"alpha_bias", e.alpha_bias},
            {"alpha_rmse", e.alpha_rmse},
            {"alpha_block_rmse", e.alpha_block_rmse}};
}

} // namespace volcomp
