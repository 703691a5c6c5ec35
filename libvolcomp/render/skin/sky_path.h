// SPDX-License-Identifier: Apache-2.0
// Light from all around that has been scattered any number of times before it comes to a skin, by
// paths at random through skins and volume (MODEL sections 4 and 5b).
#pragma once

#include "volcomp/base/random.h"
#include "volcomp/render/march/segment.h"
#include "volcomp/render/skin/skin_tracer.h"

namespace volcomp {

/// One side of a skin's hit.
struct SkinSide {
    Vec3d start, face, normal;
};
inline SkinSide frontOf(const SkinHit& hit) { return {hit.start, hit.face, hit.normal}; }
inline SkinSide backOf(const SkinHit& hit) { return {hit.back_start, -hit.face, -hit.normal}; }

/// The direction of a cosine's distribution at (u, v), both 0 to 1. What is below the triangle,
/// where its normal is not the interpolated one, is turned above it.
Vec3d cosineDirection(const SkinSide& side, double u, double v);

/// What comes from the direction `d` to a place on a skin (world), on average over `random`: of the
/// dome and RenderParams::ambient. The path goes on from what it meets: from skins and surfaces as
/// their diffuse light does, from fibres in all directions with their sine, with the albedo alpha
/// c_b (fibres' diffuse light is normalised), and through what transmits. It ends outside, or at
/// random with what it would bring no more.
Vec3d skyAlongPath(const MarchScene& scene, const SkinTracer& skins, Vec3d start, Vec3d d,
                   Random random, RayCounts& counts);

} // namespace volcomp
