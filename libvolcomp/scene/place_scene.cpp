// SPDX-License-Identifier: Apache-2.0
#include "volcomp/scene/place_scene.h"

#include <algorithm>

#include <fmt/format.h>

#include "volcomp/base/error.h"
#include "volcomp/curves/curve_pieces.h"
#include "volcomp/place/voxel_size.h"

namespace volcomp {
namespace {

/// Adds the pieces of a groom; `box` is the index of the first.
void placeGroom(const GrowthRule& rule, std::size_t box, const PlaceOptions& options,
                PlacedScene& placed)
{
    const CurvePieces pieces(rule);
    placed.warnings.insert(placed.warnings.end(), pieces.warnings().begin(),
                           pieces.warnings().end());
    PlacedLayer layer;
    layer.layer.name = rule.name;
    layer.surface = -1;
    layer.boxes = std::size_t(pieces.count());
    if (box + layer.boxes > kMostBoxes || placed.layers.size() >= kMostBoxes)
        throw Error(
            fmt::format("groom '{}': expected at most {} boxes and layers in all, found more",
                        rule.name, kMostBoxes));
    PlacementList& list = placed.boxes;
    const bool has_triangles = list.triangles.size() == list.size() && !list.empty();
    for (int piece = 0; piece < pieces.count(); ++piece) {
        Placement& p = list.placements.emplace_back();
        p.position = pieces.origin(piece);
        p.box = static_cast<std::uint16_t>(box + std::size_t(piece));
        p.layer = static_cast<std::uint16_t>(placed.layers.size());
        if (has_triangles) list.triangles.push_back(-1);
        if (options.keep_uvs) list.uvs.emplace_back(0.0f, 0.0f);
    }
    placed.layers.push_back(std::move(layer));
}

} // namespace

std::vector<BoxKind> usedBoxes(const Scene& scene)
{
    std::vector<BoxKind> kinds;
    for (const GrowthRule& rule : scene.boxes)
        if ((rule.curves && rule.curves->groom)
            || std::any_of(scene.layers.begin(), scene.layers.end(),
                           [&](const Layer& l) { return l.box == rule.name; }))
            kinds.push_back({rule.name, rule.variants});
    return kinds;
}

PlacedScene place(const Scene& scene, const PlaceOptions& options, const Progress& progress)
{
    PlacedScene placed = place(scene.surfaces, scene.layers, usedBoxes(scene), options, progress);
    std::size_t box = 0;
    for (const BoxKind& kind : placed.kinds) {
        const auto rule = std::find_if(scene.boxes.begin(), scene.boxes.end(),
                                       [&](const GrowthRule& r) { return r.name == kind.name; });
        if (rule->curves && rule->curves->groom) placeGroom(*rule, box, options, placed);
        box += std::size_t(kind.variants);
    }
    return placed;
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
