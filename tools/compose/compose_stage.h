// SPDX-License-Identifier: Apache-2.0
// The stage *compose* of the programs: placed boxes become a volume file.
#pragma once

#include <filesystem>
#include <vector>

#include "tools/shared/tool.h"
#include "volcomp/base/recipe.h"
#include "volcomp/place/placed_scene.h"
#include "volcomp/scene/scene.h"
#include "volcomp/volume/vdb_io.h"

namespace volcomp {

/// Where a volume is written, and how.
struct ComposeToFile {
    std::filesystem::path output;
    GridNames grid_names = GridNames::houdini;
    double max_memory_mb = 0; ///< a volume that needs more is refused; 0: 3/4 of the machine's
};

/// What the voxels depend on beside what is placed: the keys of [compose], and for a file also the
/// camera, the picture's size and the lights, as far as the voxel or culling depends on them.
Recipe composeRecipe(const Scene& scene, bool as_file);

/// Culls the boxes if the scene says so, checks that the memory is enough, composes, and writes the
/// volume with the recipe, to which the voxel and
/// composeRecipe() are added as options. Says what it finds and adds it to the
/// statistics. Throws Error if the memory is not enough, and as chooseVoxel(), compose() and
/// writeVolume() do.
void composeStage(Tool& tool, const Scene& scene, const std::vector<Box>& boxes, PlacedScene placed,
                  Recipe recipe, const ComposeToFile& to);

} // namespace volcomp
