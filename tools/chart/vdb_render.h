// OpenVDB's own renderer, as a peer in the charts.
#pragma once

#include <filesystem>

#include "tools/chart/chart_cache.h"
#include "volcomp/scene/scene.h"

namespace volcomp {

/// vdb_render's absorption through the scene's camera, at a step in voxels; loading is taken off by
/// a picture of one pixel. `scratch` is the file that it writes, removed at the end. Throws Error
/// where it fails.
Measured vdbRender(const Scene& scene, const RenderParams& params,
                   const std::filesystem::path& volume, double voxel, double step,
                   const std::filesystem::path& scratch);

} // namespace volcomp
