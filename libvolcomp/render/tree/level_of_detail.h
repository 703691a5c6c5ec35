// SPDX-License-Identifier: Apache-2.0
// What a ray of the picture sees, from voxels of the size that its pixel can show (MODEL section
// 8).
//
// The voxels of each level are twice as wide as those of the level before (VoxelTree::coarser()). A
// ray goes through the levels one after another (voxel_levels.h); every point of it lies in one
// level, so nothing is missed or counted twice. Light reaches a point through the level of the
// point, by rays or by a sweep of that level.
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "volcomp/view/camera.h"
#include "volcomp/render/march/integrator.h"
#include "volcomp/render/shadow/shadow_sweep.h"
#include "volcomp/render/sky/openness.h"
#include "volcomp/render/skin/skin_shading.h"
#include "volcomp/render/skin/skin_shadow.h"
#include "volcomp/render/soft_lights.h"
#include "volcomp/render/tree/voxel_levels.h"

namespace volcomp {

/// By what the distances at which levels meet are multiplied for one of a pixel's samples,
/// 1/sqrt(2) to sqrt(2): one level goes over to the next within an octave of distance, a step with
/// each sample, so that nothing pops. 1 if there is one sample.
double levelShift(int x, int y, int sample, int samples);

/// Integrators for the levels of a volume. It can be neither copied nor moved, as the integrators
/// refer to it. trace() may be called from several threads at once.
class LevelOfDetail {
public:
    /// `part_materials` holds the material of each part of the trees. `rays` are the
    /// picture's: light is swept where its rays look. `skins` may be null, and must outlive this.
    LevelOfDetail(const std::vector<VoxelLevel>& levels,
                  const std::vector<Material>& part_materials, const std::vector<Light>& lights,
                  const RenderParams& params, const CameraRays& rays,
                  const SkinTracer* skins = nullptr);

    LevelOfDetail(const LevelOfDetail&) = delete;
    LevelOfDetail& operator=(const LevelOfDetail&) = delete;

    /// As Integrator::trace(), from the level of each distance, as far as a skin; then the skin.
    /// `seen`, if not null, becomes what was added of that, if anything. `part` is that of the
    /// soft lights by which the ray sees, 0 to lightParts() - 1. Levels meet at their distances
    /// times `shift`, levelShift().
    RaySample trace(const Vec3d& origin, const Vec3d& direction, Integrator::Scratch& scratch,
                    std::optional<SeenSkin>* seen = nullptr, int part = 0, double shift = 1) const;
    int lightParts() const { return m_soft.parts(); }
    /// The memory of levels that are made on the way; null if all is there.
    TileBudget* budget() const;

    std::size_t skinShadowBytes() const; ///< memory of what skins throw on the volume
    std::size_t opennessBytes() const;   ///< 0 if nothing asks for it
    double opennessSeconds() const { return m_openness_seconds; } ///< wall time that it took

private:
    struct Level : VoxelLevel {
        std::optional<Integrator> integrator; ///< of part 0 of the soft lights
        std::vector<Integrator> other_parts;  ///< of parts 1 and up: copies with other lights

        const Integrator& byPart(int part) const
        {
            return part == 0 ? *integrator : other_parts[std::size_t(part) - 1];
        }
        std::vector<float> seen; ///< by place, as ShadowSweep wants it
        std::unique_ptr<const ShadowSweep> sweep;
        std::unique_ptr<const SkinShadow> skin_shadow;
    };
    void makeOpenness(const CameraRays& rays);
    openvdb::CoordBBox lookedAt(const Level& level, const CameraRays& rays) const;
    std::shared_ptr<const Openness> opennessAround(const Level& level,
                                                   const CameraRays& rays) const;
    void mark(const CameraRays& rays);
    void markLeaves(const CameraRay& ray, double shift,
                    std::vector<std::vector<float>>& seen) const;
    void sweep(Level& level);

    std::vector<Material> m_materials;
    SoftLights m_soft;
    RenderParams m_params;
    const SkinTracer* m_skins;
    std::vector<std::shared_ptr<const Openness>> m_openness; ///< by level, or one for all of them
    double m_openness_seconds = 0;
    std::deque<Level> m_levels;
};

} // namespace volcomp
