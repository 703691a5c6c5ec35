// SPDX-License-Identifier: Apache-2.0
// Where the voxels of a picture come from: a volume file, or placed boxes without a file between.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tools/shared/stale.h"
#include "tools/shared/tool.h"
#include "tools/shared/virtual_scene.h"
#include "volcomp/render/tree/voxel_levels.h"
#include "volcomp/scene/scene.h"
#include "volcomp/view/camera.h"

namespace volcomp {

/// What rays go through, and what it was made of.
struct RenderedVolume {
    nlohmann::json identity; ///< of the volume, for renderFingerprint()
    /// What stays the same on all machines: a hash of the recipe, or empty if there is none.
    std::string recipe;
    std::string name;  ///< for what is written into pictures: the file, or the folder of the boxes
    VirtualScene made; ///< with boxes: what the levels refer to
    std::vector<std::shared_ptr<const VoxelTree>> trees; ///< with boxes: those of all levels
    std::vector<BoxSize> sizes;                          ///< with boxes: of each
    std::vector<VoxelLevel> levels;                      ///< for the scene's camera
};

/// How a scene is rendered from its boxes.
struct FromBoxes {
    std::filesystem::path boxes; ///< folder
    Stale stale = Stale::refused;
    double max_memory_mb = 0;    ///< of the whole process; 0: half of the machine's
    std::vector<Camera> cameras; ///< for which voxels are to be fine enough; none: the scene's
};

/// Reads and places the boxes, and prepares levels whose voxels are at most compose.voxel_pixels
/// wide where the camera sees them, and no finer than compose.voxel or the finest box has them.
/// Says what it does. Throws the Errors of virtualScene(), and one if the memory that is left is
/// too little to begin with. tileBudget() comes when everything else is loaded.
RenderedVolume volumeOfBoxes(Tool& tool, const Scene& scene, const FromBoxes& from);

/// Whether a volume that was made for another camera has voxels that are fine enough for the
/// scene's, and levels that are coarse enough.
bool servesCamera(const RenderedVolume& volume, const Scene& scene);

/// Adds what was made, and the memory that it took, to the statistics, and says it.
void reportTiles(Tool& tool, const RenderedVolume& volume);

} // namespace volcomp
