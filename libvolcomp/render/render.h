// SPDX-License-Identifier: Apache-2.0
// From a volume to a picture: ray marching with closed forms per voxel (MODEL sections 3 to 5).
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <vector>

#include "volcomp/view/camera.h"
#include "volcomp/base/error.h"
#include "volcomp/view/image.h"
#include "volcomp/view/light.h"
#include "volcomp/volume/material.h"
#include "volcomp/base/progress.h"
#include "volcomp/render/render_params.h"
#include "volcomp/volume/volume.h"

namespace volcomp {

/// How much of the picture is a light's, and how much of it arrives.
struct LightShare {
    double seen = 0; ///< its share of all light that volume and skins show, 0 to 1
    /// Mean transmittance of its ways, weighted by what the picture would show of it if nothing
    /// kept it away; negative if it would show nothing.
    double arrives = -1;
};

/// What a render did; all counts are exact.
struct RenderStats {
    std::uint64_t rays = 0;            ///< of the camera
    std::uint64_t shadow_rays = 0;     ///< through the volume to lights that were not swept
    std::uint64_t shaded_voxels = 0;   ///< intervals of camera rays that were shaded
    std::uint64_t active_voxels = 0;   ///< of the finest level in use
    std::size_t skin_shadow_bytes = 0; ///< memory of the skins' shadows on the volume
    std::vector<LightShare> lights;    ///< by light; of the samples that this call has traced
    double ambient_seen = 0;           ///< share of the light that comes from all around
    std::size_t openness_bytes = 0;    ///< memory of the coarse cells that say how open places are
    double openness_seconds = 0;       ///< wall time that making them took, of prepare_seconds
    double prepare_seconds = 0, march_seconds = 0; ///< wall time
};

/// How far a render is. A stopped render goes on from it, to the same pixels as if it had not been
/// stopped.
struct RenderState {
    /// The sum over the samples so far, by pixel and channel in the order of the image.
    std::vector<double> sums;
    /// Samples a pixel so far, by tile; -1 is one sample in each fourth pixel across and down.
    std::vector<std::int32_t> samples;
};

/// For long renders: a picture soon, and a state to save.
struct RenderWatch {
    RenderState state; ///< where to go on; empty means at the start. Afterwards, what was done
    /// Renders coarsely first: every fourth pixel, then all pixels, then 2, 4, 8 ... samples. The
    /// pixels stay the same in the end.
    bool preview = false;
    double every_seconds = 10; ///< between calls of `update`, about
    /// render() calls this about every so many seconds, when it stops, and with `preview` after
    /// each pass. No pixel changes meanwhile. `so_far` is what there is to see.
    std::function<void(const RenderState& state, const Image& so_far)> update;
    /// If this becomes true, render() calls `update` and throws Stopped.
    const std::atomic<bool>* stop = nullptr;
};

/// A render was stopped from outside.
class Stopped : public Error {
public:
    using Error::Error;
};

class SkinTracer;
class VoxelTree;
struct VoxelLevel;

/// Renders a volume, given as the levels that the camera needs (voxelLevels()); there is at least
/// one. Each part takes the material of its name; an unnamed part takes the first material of its
/// kind, or the defaults. The bytes of the result do not depend on the number of threads.
///
/// The channels are R, G, B, A (premultiplied), and with params.aovs also Z, N.X, N.Y, N.Z,
/// albedo.R, albedo.G, albedo.B, NAME.R, NAME.G, NAME.B for each light, and the same of ambient,
/// background and haze, all weighted as R, G, B are. Those of the lights and of these three add up
/// to R, G and B. Z is the distance from the camera, 0 where nothing is.
///
/// `skins` are meshes beside the volume: rays end on them, they throw shadows on the volume and it
/// on them. Null means none.
///
/// Throws Error if there is no level, if a setting, the camera or a light is out of range, if a
/// material is missing or of the wrong kind, or if watch->state is one of another picture. Throws
/// Stopped if it was stopped.
Image render(const std::vector<VoxelLevel>& levels, const std::vector<Material>& materials,
             const Camera& camera, const std::vector<Light>& lights, const RenderParams& params,
             const Progress& progress = {}, RenderStats* stats = nullptr,
             RenderWatch* watch = nullptr, const SkinTracer* skins = nullptr);
/// The same; makes the levels that the camera needs. The volume stays as it is. Throws Error also
/// if the volume has no parts, their transforms differ, or a density is negative, infinite or NaN.
Image render(const VoxelTree& tree, const std::vector<Material>& materials, const Camera& camera,
             const std::vector<Light>& lights, const RenderParams& params,
             const Progress& progress = {}, RenderStats* stats = nullptr,
             const SkinTracer* skins = nullptr);
Image render(const Volume& volume, const std::vector<Material>& materials, const Camera& camera,
             const std::vector<Light>& lights, const RenderParams& params,
             const Progress& progress = {}, RenderStats* stats = nullptr,
             const SkinTracer* skins = nullptr);

} // namespace volcomp
