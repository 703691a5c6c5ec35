// What a ray of the picture sees, from voxels of the size that its pixel can show (MODEL section
// 8).
//
// Each level's voxels are twice as wide as those below (VoxelTree::coarser()). A ray goes through
// the levels one after another (voxel_levels.h), changing at the distances where a pixel is as wide
// as a voxel of the next; every point of it lies in one level, so nothing is missed or counted
// twice. Light comes through the level of the point that it meets, by rays or by a sweep of that
// level.
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "volcomp/view/camera.h"
#include "volcomp/render/march/integrator.h"
#include "volcomp/render/shadow/shadow_sweep.h"
#include "volcomp/render/tree/voxel_levels.h"

namespace volcomp {

/// Integrators for the levels of a volume; a ray goes through those as fine as its pixel is at each
/// distance.
class LevelOfDetail {
public:
    /// `rays` and `crop` are the picture's, for the light that is swept for it.
    LevelOfDetail(const std::vector<VoxelLevel>& levels,
                  const std::vector<Material>& part_materials, const std::vector<Light>& lights,
                  const RenderParams& params, const CameraRays& rays, const Crop& crop);

    /// As Integrator::trace().
    RaySample trace(const Vec3d& origin, const Vec3d& direction,
                    Integrator::Scratch& scratch) const;

    std::size_t memoryBytes() const; ///< of the levels and the light

private:
    struct Level : VoxelLevel {
        std::optional<Integrator> integrator;
        std::unique_ptr<const ShadowSweep> sweep;
    };
    void sweep(Level& level, const CameraRays& rays, const Crop& crop);

    std::vector<Material> m_materials;
    std::vector<Light> m_lights;
    RenderParams m_params;
    std::deque<Level> m_levels;
};

} // namespace volcomp
