// SPDX-License-Identifier: Apache-2.0
// Light that is scattered any number of times on its way to the eye (MODEL section 5b): paths at
// random through strands, leaves and skins.
#pragma once

#include <array>
#include <cstdint>

#include "tools/truth/embree_scene.h"
#include "volcomp/base/random.h"

namespace volcomp {

/// The random numbers of one path. A path's first vertex gets those of a lattice over the samples
/// of its pixel (Roberts's generalised golden ratio), shifted at random, which have less noise than
/// independent ones; they are as even.
class PathNumbers {
public:
    /// `key` is the same for all samples of a pixel.
    PathNumbers(std::uint64_t key, int sample)
        : m_key(key), m_sample(sample), m_random(hashKey(hashKey(key, 1), sample))
    {
    }

    /// Two numbers in [0, 1). `use` tells the uses at the first vertex (`depth` 0) apart.
    std::array<double, 2> pair(int depth, int use);
    double number() { return m_random.uniform(); }

private:
    std::uint64_t m_key;
    int m_sample;
    Random m_random;
};

/// How far light is followed.
struct PathParams {
    int bounces = 1;     ///< scatterings between a light and the eye, at least 1
    bool shadows = true; ///< without them `bounces` is 1
};

/// The radiance that a hit sends towards V (unit): by all lights, the dome and the ambient light,
/// after up to `bounces` scatterings. Lights that are soft are met at one place at random. The
/// specular lobe shows lights alone, neither the dome nor what a path meets. If `bounces` is 1 and
/// all lights are hard, no random number is used but for the dome's.
Vec3d pathRadiance(const EmbreeScene& embree, const Scene& scene, ExactHit hit, Vec3d V,
                   const PathParams& params, PathNumbers& numbers);

/// How a path goes on.
struct Scattered {
    Vec3d direction; ///< unit
    Vec3d albedo;    ///< part of the light that goes on; divided by the chance of its side
};

/// Draws a direction as the diffuse reflection of light that comes from V (unit) is distributed:
/// around a fibre by the sine of the angle to its tangent, on either side of a surface by the
/// cosine to its normal. `a` and `b` are pairs of even numbers.
Scattered scatter(const ExactHit& hit, const Vec3d& V, const std::array<double, 2>& a,
                  const std::array<double, 2>& b);

/// What arrives at `p` from one place at random of a soft light. A directional light shines from
/// anywhere on its disc, a point from its ball as it is seen from `p`, spot and patch from the disc
/// across their direction. The mean brings what the hard light would, where that is far against its
/// size. `u` is a pair of even numbers.
Illumination illuminateSoft(const Light& light, const Vec3d& p, const std::array<double, 2>& u);

} // namespace volcomp
