// SPDX-License-Identifier: Apache-2.0
#include "tools/shared/virtual_scene.h"

#include "tools/shared/place_stage.h"

namespace volcomp {

VirtualScene virtualScene(Tool& tool, const Scene& scene, const VirtualSceneOptions& options)
{
    const ReadBoxes read = tool.stage("read boxes", [&](const Progress& p) {
        return readBoxes(tool, scene, options.boxes, options.stale, p);
    });
    VirtualScene made;
    made.recipe = volumeRecipe(scene, read.used, options.leave_out);
    made.placed = std::make_unique<const PlacedScene>(placeStage(tool, scene));
    const VoxelRange range = options.voxels(*made.placed, read.boxes);
    made.composite = tool.stage("pack", [&](const Progress& p) {
        return std::make_unique<VirtualComposite>(read.boxes, *made.placed, scene.compose,
                                                  range.finest, range.levels, p);
    });
    return made;
}

} // namespace volcomp
