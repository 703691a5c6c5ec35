// SPDX-License-Identifier: Apache-2.0
#include "tools/truth/exact_picture.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <tbb/parallel_for.h>

#include "volcomp/base/error.h"
#include "volcomp/base/random.h"
#include "volcomp/render/pixel_filter.h"

namespace volcomp {
namespace {

constexpr double kClosest = 1e-6; ///< least distance to a light, world units

/// Sums of the samples of one pixel: R, G, B, A.
using Sums = std::array<double, 4>;

/// The samples from `first` to `last` of one half, a jittered grid as far as it is full and the
/// rest at random.
class HalfPixel {
public:
    HalfPixel(std::uint64_t key, int samples)
        : m_key(key), m_samples(samples), m_side(int(std::sqrt(double(samples)) + 1e-9))
    {
    }

    /// The place of a sample in the pixel's filter, as the parts of its weight across and down.
    std::array<double, 2> place(int sample) const
    {
        Random random(hashKey(m_key, sample));
        double u = random.uniform(), v = random.uniform();
        if (sample < m_side * m_side) {
            u = (sample % m_side + u) / m_side;
            v = (sample / m_side + v) / m_side;
        }
        return {u, v};
    }
    int samples() const { return m_samples; }

private:
    std::uint64_t m_key;
    int m_samples, m_side;
};

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

Vec3d radianceOf(const EmbreeScene& embree, const Scene& scene, const ExactHit& hit, const Vec3d& V,
                 bool shadows)
{
    const Material& material = *hit.material;
    Vec3d sum = material.alpha * hit.colour * scene.render.ambient;
    for (const Light& light : scene.lights) {
        const Illumination in = illuminate(light, hit.position, kClosest);
        if (!(in.weight > 0)) continue;
        const Reflection f = hit.fibre ? reflectFibre(*hit.lobe, hit.direction, V, in.L)
                                       : reflectSurface(*hit.lobe, hit.direction, V, in.L);
        if (!(f.diffuse > 0 || f.specular > 0)) continue;
        if (shadows && embree.isOccluded(hit, in.L, in.distance)) continue;
        sum += (f.diffuse * hit.colour + f.specular * material.specular_colour) * light.strength
            * in.weight;
    }
    return sum;
}

Image exactPicture(const ExactScene& exact, const EmbreeScene& embree, const ExactParams& params,
                   const Progress& progress)
{
    const Scene& scene = exact.scene;
    const RenderParams& render = scene.render;
    render.validate();
    scene.camera.validate();
    if (params.samples < (params.halves ? 2 : 1))
        throw Error(params.halves ? "expected at least 2 samples, for two halves"
                                  : "expected at least 1 sample");
    const CameraRays rays(scene.camera, render.width, render.height);
    const PixelSampler filter(render);
    const bool backed = render.background.lengthSqr() > 0; // as render(): alpha is 1 then
    const int first_samples = params.halves ? params.samples / 2 : params.samples,
              second_samples = params.samples - first_samples;

    const auto trace = [&](int x, int y, const HalfPixel& samples) {
        Sums sums{};
        for (int s = 0; s < samples.samples(); ++s) {
            const auto [u, v] = samples.place(s);
            const CameraRay ray = rays.ray(x + 0.5 + filter.warp(u), y + 0.5 + filter.warp(v));
            const auto hit = embree.hit(ray.origin, ray.direction);
            const Vec3d seen = hit ? radianceOf(embree, scene, *hit, -ray.direction, params.shadows)
                                   : render.background;
            for (int c = 0; c < 3; ++c) sums[c] += seen[c];
            sums[3] += hit || backed;
        }
        return sums;
    };

    Image image;
    image.width = render.width;
    image.height = render.height;
    image.channels = {"R", "G", "B", "A"};
    if (params.halves)
        for (const char* channel : {"half.R", "half.G", "half.B", "half.A"})
            image.channels.emplace_back(channel);
    image.pixels.resize(std::size_t(image.width) * image.height * image.channels.size());
    SharedProgress shared(progress, std::size_t(image.height));
    tbb::parallel_for(0, image.height, [&](int y) {
        for (int x = 0; x < image.width; ++x) {
            const std::uint64_t key =
                hashKey(params.seed, std::uint64_t(y) * std::uint64_t(image.width) + x);
            const Sums a = trace(x, y, HalfPixel(hashKey(key, 0), first_samples));
            float* pixel = image.pixel(x, y);
            if (!params.halves) {
                for (int c = 0; c < 4; ++c) pixel[c] = float(a[c] / first_samples);
                continue;
            }
            const Sums b = trace(x, y, HalfPixel(hashKey(key, 1), second_samples));
            // The mean of the halves, which weigh the same: then one half tells the other.
            for (int c = 0; c < 4; ++c) {
                const double first = a[c] / first_samples, second = b[c] / second_samples;
                pixel[c] = float(0.5 * (first + second));
                pixel[4 + c] = float(first);
            }
        }
        shared.add();
    });
    return image;
}

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

} // namespace volcomp
