// From boxes and placements to one sparse volume (MODEL section 8).
#pragma once

#include <vector>

#include "compose_params.h"
#include "progress.h"
#include "scatter.h"
#include "volume.h"

namespace volcomp {

/// Adds the placed boxes into one volume of voxels of edge params.voxel (> 0 here). The bytes do not depend on threads.
Volume compose(const std::vector<Box>& boxes, const std::vector<Placement>& placements, const ComposeParams& params,
               const Progress& progress = {});

} // namespace volcomp
