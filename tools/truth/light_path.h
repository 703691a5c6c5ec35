// SPDX-License-Identifier: Apache-2.0
// Light that is scattered more than once, and that of the dome, by paths at random.
#pragma once

#include "tools/truth/embree_scene.h"
#include "volcomp/base/random.h"
#include "volcomp/scene/scene.h"

namespace volcomp {

/// The radiance that comes from `first` towards V (unit) of light that is scattered `bounces` times
/// at most, >= 1.
///
/// The lights are asked at every scattering: of lights with a disc or a radius a place at random.
/// Then the path goes on in a direction drawn by the diffuse reflection (MODEL section 5b): as the
/// sine around a fibre, as the cosine on either side of a surface, through it as often as its
/// transmission has it. A path that leaves the scene brings the dome and RenderParams::ambient. The
/// specular light is that of the lights at the first scattering alone, and light of the dome is
/// scattered by normalised albedos in Scattering::single, too. Behind the fourth scattering paths
/// end at random, with the chance of what they still could bring; this keeps the mean.
Vec3d pathRadiance(const EmbreeScene& embree, const Scene& scene, ExactHit first, Vec3d V,
                   int bounces, bool shadows, Random random);

/// The light as it shines from a place of its disc or its ball, drawn at random, as seen from `p`:
/// a disc of that angle or radius across the way to p, for spots and patches across their
/// direction. Hard lights stay as they are and draw nothing.
Light drawnLight(const Light& light, const Vec3d& p, Random& random);

} // namespace volcomp
