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

/// What a render did; all counts are exact.
struct RenderStats {
    std::uint64_t rays = 0, shadow_rays = 0, shaded_voxels = 0;
    std::uint64_t active_voxels = 0;               ///< of the finest level in use
    double prepare_seconds = 0, march_seconds = 0; ///< wall
};

/// How far a render is. From it a stopped one goes on, to the same pixels as if it had not been
/// stopped.
struct RenderState {
    std::vector<double> sums; ///< of the samples so far, by pixel and channel as in the image
    std::vector<std::int32_t>
        samples; ///< so far, by tile; -1: one in each fourth pixel across and down
};

/// For long renders: a picture soon, and a state to save.
struct RenderWatch {
    RenderState state;    ///< where to go on; empty: at the start. Afterwards what was done
    bool preview = false; ///< coarse first: every fourth pixel, then all, then 2, 4, 8 ... samples;
                          ///< the pixels stay the same
    double every_seconds = 10;
    /// Called about every so many seconds, when the render stops, and with `preview` after each of
    /// its passes; no pixel changes meanwhile. The image is what there is to see so far.
    std::function<void(const RenderState& state, const Image& so_far)> update;
    const std::atomic<bool>* stop =
        nullptr; ///< where this becomes true, render() calls update and throws Stopped
};

/// A render was stopped from outside.
class Stopped : public Error {
public:
    using Error::Error;
};

class VoxelTree;
struct VoxelLevel;

/// The picture of a volume. Parts find their material by name; an unnamed part takes the first
/// material of its kind, or the defaults. The bytes of the result do not depend on the number of
/// threads. Channels: R, G, B, A (premultiplied), and with params.aovs Z, N.X, N.Y, N.Z, albedo.R,
/// albedo.G, albedo.B and NAME.R, NAME.G, NAME.B of each light, all weighted like R, G, B; depths
/// are distances from the camera, 0 where nothing is. Throws Error for a material that is not there
/// and for a state of another picture; Stopped.
Image render(const std::vector<VoxelLevel>& levels, const std::vector<Material>& materials,
             const Camera& camera, const std::vector<Light>& lights, const RenderParams& params,
             const Progress& progress = {}, RenderStats* stats = nullptr,
             RenderWatch* watch = nullptr);
/// With the levels that the camera needs, made anew.
Image render(const VoxelTree& tree, const std::vector<Material>& materials, const Camera& camera,
             const std::vector<Light>& lights, const RenderParams& params,
             const Progress& progress = {}, RenderStats* stats = nullptr);
Image render(const Volume& volume, const std::vector<Material>& materials, const Camera& camera,
             const std::vector<Light>& lights, const RenderParams& params,
             const Progress& progress = {}, RenderStats* stats = nullptr);

} // namespace volcomp
