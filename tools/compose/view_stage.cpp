// SPDX-License-Identifier: Apache-2.0
#include "tools/compose/view_stage.h"

#include <fmt/format.h>

#include "tools/shared/rendered_volume.h"
#include "volcomp/base/recipe.h"
#include "volcomp/render/tree/view_volumes.h"

namespace volcomp {

std::filesystem::path levelFile(const std::filesystem::path& volume, int level)
{
    std::filesystem::path file = volume;
    return file.replace_extension(fmt::format(".level{}.vdb", level));
}

void viewStage(Tool& tool, const Scene& scene, const ViewToFiles& to)
{
    const RenderedVolume made =
        volumeOfBoxes(tool, scene, {to.boxes, to.stale, to.max_memory_mb, {}});
    const std::vector<VoxelLevel> levels = made.levels;
    std::size_t voxels = 0;
    for (std::size_t n = 0; n < levels.size(); ++n) {
        const double voxel = levels[n].tree->voxelSize();
        const PackedVolume volume = tool.stage(fmt::format("level {}", n), [&](const Progress&) {
            return viewVolume(levels, n, scene.camera.eye);
        });
        // The next level needs nothing of this one.
        levels[n].tree->tiles()->budget().relieve(0);
        tool.stats["levels"].push_back({{"voxel_m", voxel}, {"voxels", volume.voxels()}});
        if (volume.voxels() == 0) continue;
        voxels += volume.voxels();
        Recipe recipe = made.made.recipe;
        recipe.add(std::string(kOption) + "voxel", fmt::format("{}", voxel));
        recipe.add(std::string(kOption) + "level", std::to_string(n));
        openvdb::MetaMap about;
        about.insertMeta(kRecipe, openvdb::StringMetadata(recipe.text()));
        const std::filesystem::path file = levelFile(to.output, int(n));
        tool.stage("write " + file.filename().string(),
                   [&](const Progress&) { writeVolume(file, volume, about, to.grid_names); });
        tool.say(fmt::format("{}: {} voxels of {:.4g} m, looked at from {:.4g} m on", file.string(),
                             volume.voxels(), voxel, levels[n].start));
    }
    if (voxels == 0) tool.warn("no voxel is looked at; nothing is written");
}

} // namespace volcomp
