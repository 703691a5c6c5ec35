// SPDX-License-Identifier: Apache-2.0
#include "tools/truth/exact_picture.h"

#include <array>
#include <cmath>

#include <tbb/parallel_for.h>

#include "volcomp/base/error.h"
#include "volcomp/base/interval.h"
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
    int samples() const { return m_samples; }
    PathNumbers path(int sample) const { return {hashKey(m_key, kPaths), sample}; }

private:
    static constexpr std::uint64_t kPaths = 1ULL << 32; ///< beyond all samples
    std::uint64_t m_key;
    int m_samples, m_side;
};

} // namespace

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
    if (params.paths.bounces < 1 || (params.paths.bounces > 1 && !params.paths.shadows))
        throw Error("expected at least 1 bounce, and without shadows 1");
    const CameraRays rays(scene.camera, render.width, render.height);
    const PixelSampler filter(render);
    const bool backed = render.hasBackdrop(); // as render(): alpha is 1 then
    const int first_samples = params.halves ? params.samples / 2 : params.samples,
              second_samples = params.samples - first_samples;

    const auto trace = [&](int x, int y, const HalfPixel& samples) {
        Sums sums{};
        for (int s = 0; s < samples.samples(); ++s) {
            const auto [u, v] = samples.place(s);
            const CameraRay ray = rays.ray(x + 0.5 + filter.warp(u), y + 0.5 + filter.warp(v));
            const auto hit = embree.hit(ray.origin, ray.direction);
            PathNumbers numbers = samples.path(s);
            const Vec3d seen = hit
                ? pathRadiance(embree, scene, *hit, -ray.direction, params.paths, numbers)
                : render.backdrop(ray.direction);
            const HazeRay haze(render.haze, ray.origin, ray.direction);
            const double distance = hit ? (hit->position - ray.origin).length() : kInfinity;
            const Vec3d hazy = haze.seen(seen, distance);
            for (int c = 0; c < 3; ++c) sums[c] += hazy[c];
            sums[3] += hit || backed ? 1 : 1 - haze.transmittance(kInfinity);
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
