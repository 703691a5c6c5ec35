// SPDX-License-Identifier: Apache-2.0
#include "tools/shared/virtual_scene.h"

#include <utility>

#include "tools/shared/memory.h"
#include "tools/shared/place_stage.h"

namespace volcomp {

VirtualScene virtualScene(Tool& tool, const Scene& scene, const VirtualSceneOptions& options)
{
    ReadPackedBoxes read = tool.stage("read boxes", [&](const Progress& p) {
        return readPackedBoxes(tool, scene, options.boxes, options.stale, p);
    });
    returnFreedMemory(); // of the boxes' grids, a leaf at a time
    VirtualScene made;
    made.recipe = volumeRecipe(scene, read.used, options.leave_out);
    made.placed = std::make_unique<const PlacedScene>(placeStage(tool, scene));
    const VoxelRange range = options.voxels(*made.placed, read.boxes);
    made.composite = tool.stage("pack", [&](const Progress& p) {
        return std::make_unique<VirtualComposite>(std::move(read.boxes), *made.placed,
                                                  scene.compose, range.finest, range.levels, p);
    });
    returnFreedMemory();
    return made;
}

} // namespace volcomp
