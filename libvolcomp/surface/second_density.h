// SPDX-License-Identifier: Apache-2.0
// A second density (MODEL section 7): a number or a colour at every place of a surface, made of
// images, constants, noise and products of them.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "volcomp/surface/mesh.h"
#include "volcomp/surface/texture.h"
#include "volcomp/base/vec.h"

namespace volcomp {

/// One factor: an image, or noise, or, if neither is given, the constant.
struct MapFactor {
    std::filesystem::path image;
    /// Channel of the image, counted from 0. -1 is its luminance, or red, green and blue if the
    /// factor gives a colour.
    int channel = -1;
    Wrap wrap = Wrap::repeat;
    Vec2d repeat{1, 1};       ///< number of repeats of the image per unit of u and of v
    double noise = 0;         ///< size of the noise's features, world units; 0: no noise
    int octaves = 1;          ///< octaves of the noise, each half as large and half as strong
    std::uint64_t seed = 1;   ///< of the noise
    Vec3d constant{1.0};      ///< a colour, linear RGB; a number uses the first component
    double low = 0, high = 1; ///< what 0 and 1 of the image or of the noise become

    /// Throws Error if a value is out of range or not finite, or there are both an image and noise.
    void validate() const;
};

/// The product of factors, 1 if there are none. The constructor reads the images and throws their
/// Errors. Copies share the images, which never change. May be used by several threads at a time.
class SecondDensity {
public:
    SecondDensity() = default;
    /// `colour` says that images hold colours, which are converted to linear RGB by what their
    /// files say; numbers are taken as they are.
    SecondDensity(const std::vector<MapFactor>& factors, bool colour);

    bool isConstant() const; ///< true if it is the same everywhere
    bool usesUv() const;     ///< true if some factor is an image

    /// The number or the colour (linear RGB) at the place `p` of the world, whose (u,v) is `uv`.
    float value(const Vec2d& uv, const Vec3d& p) const;
    Vec3f colour(const Vec2d& uv, const Vec3d& p) const;

    bool hasAlpha() const; ///< true if alpha() is below 1 somewhere; of colours only
    /// The product of the alphas of the images that are taken as colours, 1 if there are none.
    float alpha(const Vec2d& uv) const;

private:
    struct Factor {
        MapFactor spec;
        std::shared_ptr<const Texture> texture;
        bool has_alpha = false; ///< the image is a colour and not opaque everywhere
    };
    std::vector<Factor> m_factors;
};

/// Perlin's improved gradient noise (SIGGRAPH 2002) with a hash of 64 bits. Its features are about
/// as long as the unit of `p`. Its mean is 1/2; it is clamped to 0 and 1. Returns 1/2 for places
/// further than 1e15 from the origin.
double gradientNoise(const Vec3d& p, int octaves, std::uint64_t seed);

} // namespace volcomp
