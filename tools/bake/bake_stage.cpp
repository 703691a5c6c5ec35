// SPDX-License-Identifier: Apache-2.0
#include "tools/bake/bake_stage.h"

#include <cstdint>
#include <numeric>

#include <fmt/format.h>

#include "tools/shared/read_boxes.h"
#include "volcomp/bake/bake.h"
#include "volcomp/curves/curve_pieces.h"
#include "volcomp/scene/groom_voxel.h"
#include "volcomp/scene/scene_recipe.h"

namespace volcomp {
namespace {

/// The voxel to bake a rule with; 0: as voxelFor() chooses for each variant.
double voxelOf(const Scene& scene, const GrowthRule& rule, const BoxContents& contents)
{
    const bool is_groom = rule.curves && rule.curves->groom;
    return rule.voxel > 0 || !is_groom ? rule.voxel : groomVoxel(scene, *contents.curves());
}

/// Bakes one variant to its file and returns it.
Box bakeToFile(const Scene& scene, const GrowthRule& rule, const BoxContents& contents, int variant,
               const BakeToFiles& to, const Progress& progress)
{
    Box box = rule.mesh.file.empty()
        ? bakeSkeleton(contents.skeleton(variant), rule, scene.materials, variant,
                       voxelOf(scene, rule, contents), progress)
        : bake(rule, scene.materials, variant, progress);
    openvdb::MetaMap about;
    about.insertMeta(kRecipe, openvdb::StringMetadata(boxRecipe(scene, rule).text()));
    about.insertMeta(boxMetadata(rule, variant));
    writeVolume(boxFile(to.directory, rule.name, variant), box.volume, about, to.grid_names);
    return box;
}

} // namespace

std::vector<int> allVariants(const GrowthRule& rule)
{
    std::vector<int> variants(std::size_t(rule.variants));
    std::iota(variants.begin(), variants.end(), 0);
    return variants;
}

void bakeStage(Tool& tool, const Scene& scene, const GrowthRule& rule,
               const std::vector<int>& variants, const BakeToFiles& to)
{
    if (!rule.files.empty()) {
        tool.say(rule.name + ": has files of its own, nothing to bake");
        return;
    }
    std::uint64_t voxels = 0;
    double voxel = 0;
    tool.stage("bake " + rule.name, [&](const Progress& progress) {
        const BoxContents contents(rule);
        for (std::size_t i = 0; i < variants.size(); ++i) {
            const Box box = bakeToFile(scene, rule, contents, variants[i], to, [&](double f) {
                report(progress, (double(i) + f) / double(variants.size()));
            });
            for (const std::string& warning : box.volume.warnings) tool.warn(warning);
            for (const VolumePart& part : box.volume.parts)
                voxels += part.density->activeVoxelCount();
            voxel = box.volume.voxelSize();
            if (to.thumbnails)
                to.thumbnails->push_back(renderBoxThumbnail(box, scene.materials, scene.render));
        }
    });
    tool.stats["boxes"][rule.name] = {
        {"variants", variants.size()}, {"voxels", voxels}, {"voxel", voxel}};
    tool.say(fmt::format("{}: {} of {} voxels of {:.4g} m", rule.name,
                         variants.size() == 1 ? "1 box" : fmt::format("{} boxes", variants.size()),
                         voxels, voxel));
}

} // namespace volcomp
