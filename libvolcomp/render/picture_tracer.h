// SPDX-License-Identifier: Apache-2.0
// What all pixels of one picture share, prepared once: materials, camera rays, levels of detail and
// swept light.
#pragma once

#include <vector>

#include "volcomp/render/render_params.h"
#include "volcomp/render/tree/level_of_detail.h"
#include "volcomp/render/tree/voxel_levels.h"
#include "volcomp/view/camera.h"
#include "volcomp/view/light.h"
#include "volcomp/volume/material.h"

namespace volcomp {

/// The rectangle that is rendered: RenderParams::crop, or the whole picture.
Crop pixelsOf(const RenderParams& params);

/// The sample `number` of the pixel (x, y) of the whole picture.
inline SampleNumber sampleNumber(const RenderParams& params, int x, int y, int number)
{
    return {static_cast<std::uint64_t>(y) * static_cast<std::uint64_t>(params.width) + x, number};
}

/// Traces the camera rays of one picture. Threads share it; each has its own Integrator::Scratch.
class PictureTracer {
public:
    /// Finds the material of each part, as render() says, and sweeps the light if the settings want
    /// it. The trees of the levels and the skins, which may be null, must outlive this. Throws
    /// Error if a setting, the camera or a light is out of range, or if a part's material is
    /// missing or of the wrong kind.
    PictureTracer(const std::vector<VoxelLevel>& levels, const std::vector<Material>& materials,
                  const Camera& camera, const std::vector<Light>& lights,
                  const RenderParams& params, const SkinTracer* skins = nullptr);

    /// The ray through a place of the whole picture, pixels from its top left corner.
    CameraRay ray(double x, double y) const { return m_rays.ray(x, y); }
    /// LevelOfDetail::trace().
    RaySample trace(const CameraRay& ray, Integrator::Scratch& scratch,
                    std::optional<SeenSkin>* seen = nullptr, int light_part = 0,
                    double shift = 1) const
    {
        return m_tracer.trace(ray.origin, ray.direction, scratch, seen, light_part, shift);
    }
    int lightParts() const { return m_tracer.lightParts(); }
    TileBudget* budget() const { return m_tracer.budget(); } ///< LevelOfDetail::budget()
    std::size_t skinShadowBytes() const { return m_tracer.skinShadowBytes(); }
    std::size_t opennessBytes() const { return m_tracer.opennessBytes(); }
    double opennessSeconds() const { return m_tracer.opennessSeconds(); }

    const Crop& crop() const { return m_crop; } ///< pixelsOf(params())
    const RenderParams& params() const { return m_params; }

private:
    const RenderParams m_params;
    const Crop m_crop;
    const CameraRays m_rays;
    const LevelOfDetail m_tracer;
};

} // namespace volcomp
