// SPDX-License-Identifier: Apache-2.0
// Light from all around on skins: the dome and RenderParams::ambient, with what stands in its way
// (MODEL section 4).
#pragma once

#include "volcomp/render/march/segment.h"
#include "volcomp/render/skin/skin_tracer.h"

namespace volcomp {

/// Directions that a pixel with these samples looks in from a skin, for each sample: 32 in all, but
/// 4 to 8 a sample.
int skinDirections(int samples);

/// The light from all around on the two sides of a skin: irradiance over pi, so that a white
/// diffuse surface shows it.
struct DomeLight {
    Vec3d front{0.0}; ///< of the side that the eye sees
    Vec3d back{0.0};  ///< of the other; only if the material transmits light
};

/// Finds it at a hit: the mean over skinDirections() directions, distributed as their cosine, and
/// as many on the other side; fewer if `weight`, the share of the pixel that shows the hit, is
/// small. The directions are those of SampleNumber, so that the samples of a pixel share them out
/// evenly. With shadows, skins and the volume stand in the way. What a direction meets is black
/// with Scattering::single; with `multiple` it is what a path brings that goes on from there
/// (sky_path.h).
DomeLight domeLight(const MarchScene& scene, const SkinTracer& skins, const SkinHit& hit,
                    const SampleNumber& sample, double weight, RayCounts& counts);

} // namespace volcomp
