// SPDX-License-Identifier: Apache-2.0
// The recursive function that fills a box: from parameters to tapered round cones and flat pieces
// (MODEL section 6).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "volcomp/grow/growth_rule.h"
#include "volcomp/base/vec.h"

namespace volcomp {

/// A piece of a strand: a tapered round cone, or, if `side` is not zero, a flat trapezoid. Box
/// space, metres.
struct Segment {
    Vec3f a, b;                   ///< ends of the axis
    Vec3f side{0.0f};             ///< unit, across a flat piece and perpendicular to its axis
    float size_a = 0, size_b = 0; ///< radius, or half the width of a flat piece
    Vec3f colour_a{1.0f}, colour_b{1.0f}; ///< linear RGB
    std::uint32_t strand = 0; ///< the same for all pieces of one strand, which follow each other
                              ///< and count once in a voxel that they share

    bool flat() const { return side != Vec3f(0.0f); }
};

/// All strands of one material.
struct SkeletonPart {
    std::string material;
    std::vector<Segment> segments;
};
using Skeleton = std::vector<SkeletonPart>;

/// Grows variant `variant`: one part for each material. Every random choice is a function of the
/// seed, the variant and the strand's place in the recursion, so the result is the same for any
/// number of threads, and on every machine (portable_math.h). Pieces of zero length or zero width
/// are left out. Throws Error as GrowthRule::validate() does, before anything grows.
Skeleton grow(const GrowthRule& rule, int variant);

} // namespace volcomp
