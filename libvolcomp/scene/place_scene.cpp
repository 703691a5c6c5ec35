// SPDX-License-Identifier: Apache-2.0
#include "volcomp/scene/place_scene.h"

#include <algorithm>

#include "volcomp/base/error.h"
#include "volcomp/place/voxel_size.h"

namespace volcomp {

std::vector<BoxKind> usedBoxes(const Scene& scene)
{
    std::vector<BoxKind> kinds;
    for (const GrowthRule& rule : scene.boxes)
        if (std::any_of(scene.layers.begin(), scene.layers.end(),
                        [&](const Layer& l) { return l.box == rule.name; }))
            kinds.push_back({rule.name, rule.variants});
    return kinds;
}

PlacedScene place(const Scene& scene, const PlaceOptions& options, const Progress& progress)
{
    return place(scene.surfaces, scene.layers, usedBoxes(scene), options, progress);
}

ChosenVoxel chooseVoxel(const Scene& scene, const PlacedScene& placed,
                        const std::vector<Box>& boxes)
{
    if (scene.compose.voxel > 0) return {scene.compose.voxel, VoxelSource::scene};
    const double seen = voxelFromCamera(placed, scene.camera, scene.render.width,
                                        scene.render.height, scene.compose.voxel_pixels);
    if (seen > 0) return {seen, VoxelSource::camera};
    if (boxes.empty())
        throw fileError(scene.file, "compose.voxel",
                        "a voxel size, as the camera sees no surface and there are no boxes", "0");
    double finest = boxes[0].volume.voxelSize();
    for (const Box& b : boxes) finest = std::min(finest, b.volume.voxelSize());
    return {finest, VoxelSource::boxes};
}

} // namespace volcomp
