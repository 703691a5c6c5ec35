// SPDX-License-Identifier: Apache-2.0
// A colour that is looked up at every voxel of a layer's boxes, so that a pattern's border can cut
// through a tuft.
#pragma once

#include "volcomp/surface/second_density.h"
#include "volcomp/surface/surface.h"

namespace volcomp {

/// The colour is looked up at the (u,v) of the voxel's own place. This is the surface's projection
/// of that place. If the surface has texture coordinates instead of a projection, it is those of
/// the point of the surface nearest to the voxel, which a walk from where the box stands finds. The
/// pointers must outlive the look-ups.
struct VoxelTint {
    const Surface* surface = nullptr;
    const SecondDensity* colour = nullptr;
    std::int32_t triangle = -1; ///< of the surface on which the box stands; -1: unknown
};

/// Looks up the colours of one placed box. Each walk over the surface starts where the last ended,
/// so close voxels should follow each other. Not for several threads at once.
class TintWalk {
public:
    explicit TintWalk(const VoxelTint& tint);

    /// Returns the colour (linear) at a place in the world.
    Vec3f at(const Vec3d& world);

private:
    VoxelTint m_tint;
    bool m_by_mesh;          ///< texture coordinates, not a projection
    std::int32_t m_triangle; ///< where the next walk starts; -1: unknown
};

} // namespace volcomp
