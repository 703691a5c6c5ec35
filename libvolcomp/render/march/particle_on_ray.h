// SPDX-License-Identifier: Apache-2.0
// Which voxel a ray ends in, for rays at random.
#pragma once

#include <optional>

#include "volcomp/render/march/march_scene.h"
#include "volcomp/render/march/shading.h"

namespace volcomp {

struct ParticleOnRay {
    SeenVoxel voxel;
    Vec3d p; ///< corner coordinates, in it or on its faces
};

/// Where the optical depth along a ray through the scene's tree (not its dual) reaches `depth`;
/// nothing if it does not. With -ln of an even random number from 0 to 1 it is where a photon meets
/// its first particle. The density is that of the box filter. `direction` is the ray's in world
/// axes, unit length.
std::optional<ParticleOnRay> particleAtDepth(const MarchScene& scene, const MarchRay& ray,
                                             const Vec3d& direction, double depth);

} // namespace volcomp
