// From a volume to a picture: ray marching with closed forms per voxel (MODEL sections 3 to 5).
#pragma once

#include <cstdint>
#include <vector>

#include "camera.h"
#include "image.h"
#include "light.h"
#include "material.h"
#include "progress.h"
#include "render_params.h"
#include "volume.h"

namespace volcomp {

/// What a render did; all counts are exact.
struct RenderStats {
    std::uint64_t rays = 0, shadow_rays = 0, shaded_voxels = 0, active_voxels = 0;
    double prepare_seconds = 0, march_seconds = 0;   ///< wall
};

class VoxelTree;

/// The picture of a volume. Parts find their material by name; an unnamed part takes the first material of its kind, or the
/// defaults. The bytes of the result do not depend on the number of threads. Channels: R, G, B, A (premultiplied), and with
/// params.aovs Z, N.X, N.Y, N.Z, albedo.R, albedo.G, albedo.B and NAME.R, NAME.G, NAME.B of each light, all weighted like R, G, B; depths
/// are distances from the camera, 0 where nothing is. Throws Error for a material that is not there.
Image render(const VoxelTree& tree, const std::vector<Material>& materials, const Camera& camera,
             const std::vector<Light>& lights, const RenderParams& params, const Progress& progress = {},
             RenderStats* stats = nullptr);
Image render(const Volume& volume, const std::vector<Material>& materials, const Camera& camera,
             const std::vector<Light>& lights, const RenderParams& params, const Progress& progress = {},
             RenderStats* stats = nullptr);

} // namespace volcomp
