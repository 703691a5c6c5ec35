// A second density (MODEL section 7): a number or a colour at every place of a surface, from
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

/// One factor. It is an image, noise, or, where neither is given, the constant.
struct MapFactor {
    std::filesystem::path image;
    int channel = -1; ///< of the image, from 0; -1: luminance (a colour map: red, green, blue)
    Wrap wrap = Wrap::repeat;
    Vec2d repeat{1, 1};       ///< the image stands so many times in the unit square of (u,v)
    double noise = 0;         ///< size of the noise's features, world units; 0: no noise
    int octaves = 1;          ///< of the noise, each half as large and half as strong
    std::uint64_t seed = 1;   ///< of the noise
    Vec3d constant{1.0};      ///< a number map uses the first
    double low = 0, high = 1; ///< what an image's or noise's 0 and 1 become

    void validate() const;
};

/// The product of its factors; of none, 1. Images are read once, in the constructor, which throws
/// their Errors. May be asked from several threads.
class SecondDensity {
public:
    SecondDensity() = default;
    SecondDensity(const std::vector<MapFactor>& factors, bool colour);

    bool isConstant() const; ///< the same everywhere
    bool usesUv() const;     ///< some factor is an image
    float value(const Vec2d& uv, const Vec3d& p) const;
    Vec3f colour(const Vec2d& uv, const Vec3d& p) const;

private:
    struct Factor {
        MapFactor spec;
        std::shared_ptr<const Texture> texture;
    };
    std::vector<Factor> m_factors;
};

/// Perlin's gradient noise, improved (SIGGRAPH 2002) with a hash of 64 bits; about 0 to 1 with mean
/// 1/2, clamped, its features of about the unit length.
double gradientNoise(const Vec3d& p, int octaves, std::uint64_t seed);

} // namespace volcomp
