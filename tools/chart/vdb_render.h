// SPDX-License-Identifier: Apache-2.0
// OpenVDB's own renderer, to compare with in the charts.
#pragma once

#include <filesystem>

#include "tools/chart/chart_cache.h"
#include "volcomp/scene/scene.h"

namespace volcomp {

/// Runs vdb_render on a volume with the scene's camera and absorption alone, with a step in voxels.
/// The time of a picture of one pixel, which is that of loading, is subtracted. `scratch` is the
/// file that vdb_render writes; it is removed at the end. Throws Error if vdb_render fails.
Measured vdbRender(const Scene& scene, const RenderParams& params,
                   const std::filesystem::path& volume, double voxel, double step,
                   const std::filesystem::path& scratch);

} // namespace volcomp
