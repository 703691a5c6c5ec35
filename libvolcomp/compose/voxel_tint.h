// A colour that is looked up at every voxel of a layer's boxes, so that a pattern's border can cut
// through a tuft.
#pragma once

#include "volcomp/surface/second_density.h"
#include "volcomp/surface/surface.h"

namespace volcomp {

/// Looked up at the (u,v) of the voxel's own place: by the surface's projection; or, by texture
/// coordinates, of the surface's point nearest to the voxel on a walk from where the box stands.
/// The pointers must outlive it.
struct VoxelTint {
    const Surface* surface = nullptr;
    const SecondDensity* colour = nullptr;
    std::int32_t triangle = -1; ///< of the surface on which the box stands; -1: unknown
};

/// The look-ups of one placed box, one after another.
class TintWalk {
public:
    explicit TintWalk(const VoxelTint& tint);

    Vec3f at(const Vec3d& world);

private:
    const VoxelTint& m_tint;
    bool m_by_mesh; ///< texture coordinates, not a projection
    std::int32_t m_triangle;
};

} // namespace volcomp
