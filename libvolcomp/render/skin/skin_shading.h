// SPDX-License-Identifier: Apache-2.0
// What a ray that has met a skin brings (MODEL section 4).
#pragma once

#include <vector>

#include "volcomp/render/march/segment.h"
#include "volcomp/render/skin/skin_tracer.h"

namespace volcomp {

/// What an observer learns of a skin that a ray has met.
struct SeenSkin {
    SkinHit hit;
    double transmittance;          ///< from the ray's origin to the skin, the share of the pixel
    std::vector<SeenLight> lights; ///< those of which the skin reflects something
    Vec3d ambient{0.0};            ///< radiance added for the dome and RenderParams::ambient
};

/// Adds the skin that a ray has met to the sample, behind what that has seen; nothing passes it. If
/// less than RenderParams::cutoff comes so far, it adds nothing. `V` leads to the eye (unit,
/// world); `scene` has the volume that shadows the skin. Light that the skins or the volume keep
/// away is found by rays, or for the volume by its sweep where that knows it; that from all around
/// by skin_dome.h. `seen`, if not null,
/// becomes what was added.
void addSkin(const MarchScene& scene, const SkinTracer& skins, const SkinHit& hit, const Vec3d& V,
             RaySample& sample, RayScratch& scratch, std::optional<SeenSkin>* seen = nullptr);

} // namespace volcomp
