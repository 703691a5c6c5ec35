// SPDX-License-Identifier: Apache-2.0
#include "tools/truth/exact_picture.h"

#include <array>
#include <cmath>

#include <tbb/parallel_for.h>

#include "tools/truth/light_path.h"
#include "volcomp/base/error.h"
#include "volcomp/base/random.h"
#include "volcomp/render/pixel_filter.h"

namespace volcomp {
namespace {

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
    /// The random numbers of what the sample sees.
    Random path(int sample) const { return Random(hashKey(hashKey(m_key, sample), 1)); }
    int samples() const { return m_samples; }

private:
    std::uint64_t m_key;
    int m_samples, m_side;
};

} // namespace

int bouncesOf(const RenderParams& params)
{
    return params.scattering == Scattering::single ? 1 : 128;
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
    const bool backed = render.hasBackdrop(); // as render(): alpha is 1 then
    const int first_samples = params.halves ? params.samples / 2 : params.samples,
              second_samples = params.samples - first_samples;

    const int bounces = params.bounces > 0 ? params.bounces : bouncesOf(render);
    const auto trace = [&](int x, int y, const HalfPixel& samples) {
        Sums sums{};
        for (int s = 0; s < samples.samples(); ++s) {
            const auto [u, v] = samples.place(s);
            const CameraRay ray = rays.ray(x + 0.5 + filter.warp(u), y + 0.5 + filter.warp(v));
            const auto hit = embree.hit(ray.origin, ray.direction);
            const Vec3d seen = hit ? pathRadiance(embree, scene, *hit, -ray.direction, bounces,
                                                  params.shadows, samples.path(s))
                                   : render.backdrop(ray.direction);
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

} // namespace volcomp
