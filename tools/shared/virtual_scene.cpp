// SPDX-License-Identifier: Apache-2.0
#include "tools/shared/virtual_scene.h"

#include <utility>

#include "tools/shared/memory.h"
#include "tools/shared/place_stage.h"
#include "volcomp/compose/box_pyramids.h"

namespace volcomp {

VirtualScene virtualScene(Tool& tool, const Scene& scene, const VirtualSceneOptions& options)
{
    // One box after the other: as grids they take ten times the memory, or more.
    std::vector<PackedBox> boxes;
    std::vector<BoxSize> sizes;
    const std::vector<UsedBox> used = tool.stage("read boxes", [&](const Progress& p) {
        return readBoxes(
            tool, scene, options.boxes, options.stale,
            [&](Box&& box) {
                sizes.push_back({ballOf(box), box.volume.voxelSize()});
                boxes.push_back(packBox(box));
            },
            p);
    });
    giveBackFreeMemory();
    VirtualScene made;
    made.recipe = volumeRecipe(scene, used, options.leave_out);
    made.placed = std::make_unique<const PlacedScene>(placeStage(tool, scene));
    const VoxelRange range = options.voxels(*made.placed, sizes);
    made.composite = tool.stage("pack", [&](const Progress& p) {
        return std::make_unique<VirtualComposite>(std::move(boxes), *made.placed, scene.compose,
                                                  range.finest, range.levels, p);
    });
    giveBackFreeMemory();
    return made;
}

} // namespace volcomp
