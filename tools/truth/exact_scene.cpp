// SPDX-License-Identifier: Apache-2.0
#include "tools/truth/exact_scene.h"

#include <algorithm>

#include "volcomp/base/error.h"
#include "volcomp/curves/curve_pieces.h"
#include "volcomp/scene/place_scene.h"

namespace volcomp {

std::size_t ExactScene::segmentCount() const
{
    std::vector<std::size_t> of_box;
    for (std::size_t b = 0; b < boxes.size(); ++b) {
        of_box.push_back(meshes[b] ? meshes[b]->triangleCount() : 0);
        for (const SkeletonPart& part : boxes[b]) of_box.back() += part.segments.size();
    }
    std::size_t count = 0;
    for (const Placement& p : placed.boxes.placements) count += of_box[p.box];
    return count;
}

const Material& ExactScene::material(const std::string& name) const
{
    const auto found = std::find_if(scene.materials.begin(), scene.materials.end(),
                                    [&](const Material& m) { return m.name == name; });
    if (found == scene.materials.end())
        throw fileError(scene.file, "material", "a [material." + name + "] table", "none");
    return *found;
}

VoxelTint ExactScene::tintOf(std::size_t placement) const
{
    const Placement& p = placed.boxes.placements[placement];
    if (p.layer >= placed.layers.size() || !placed.layers[p.layer].tints_voxels) return {};
    const PlacedLayer& layer = placed.layers[p.layer];
    return {&placed.surfaces[layer.surface].surface, &layer.tint, placed.boxes.triangle(placement)};
}

ExactScene makeExactScene(Scene scene, const Progress& progress)
{
    ExactScene exact;
    const std::vector<BoxKind> kinds = usedBoxes(scene);
    for (std::size_t k = 0; k < kinds.size(); ++k) {
        const auto rule =
            std::find_if(scene.boxes.begin(), scene.boxes.end(),
                         [&](const GrowthRule& r) { return r.name == kinds[k].name; });
        if (!rule->files.empty())
            throw fileError(scene.file, "box " + rule->name, "levels, curves or a mesh, to trace",
                            "files of voxels");
        const auto mesh = rule->mesh.file.empty()
            ? nullptr
            : std::make_shared<const MeshModel>(loadMeshModel(*rule, scene.materials));
        if (mesh)
            exact.warnings.insert(exact.warnings.end(), mesh->warnings.begin(),
                                  mesh->warnings.end());
        const BoxContents contents(*rule);
        for (int variant = 0; variant < kinds[k].variants; ++variant) {
            exact.boxes.push_back(mesh ? Skeleton() : contents.skeleton(variant));
            exact.meshes.push_back(mesh);
        }
        report(progress, 0.5 * double(k + 1) / double(kinds.size()));
    }
    exact.placed = place(scene, {}, [&](double f) { report(progress, 0.5 + 0.5 * f); });
    exact.scene = std::move(scene);
    return exact;
}

} // namespace volcomp
