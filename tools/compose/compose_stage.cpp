// SPDX-License-Identifier: Apache-2.0
#include "tools/compose/compose_stage.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "tools/shared/memory.h"
#include "tools/shared/settings.h"
#include "volcomp/base/clock.h"
#include "volcomp/base/error.h"
#include "volcomp/base/interval.h"
#include "volcomp/compose/compose.h"
#include "volcomp/place/culling.h"
#include "volcomp/scene/place_scene.h"
#include "volcomp/scene/scene_dome.h"
#include "volcomp/scene/scene_recipe.h"

namespace volcomp {
namespace {

/// Returns the edge of a voxel to compose with, and says where it comes from.
double voxelSize(const Tool& tool, const Scene& scene, const PlacedScene& placed,
                 const std::vector<Box>& boxes)
{
    const ChosenVoxel voxel = chooseVoxel(scene, placed, boxes);
    if (voxel.source == VoxelSource::camera)
        tool.say(fmt::format(
            "voxels of {:.4g} m: {:g} of a pixel at the nearest point that the camera sees",
            voxel.size, scene.compose.voxel_pixels));
    if (voxel.source == VoxelSource::boxes)
        tool.warn(fmt::format(
            "the camera sees no surface; voxels of {:.4g} m, as the finest box has", voxel.size));
    return voxel.size;
}

void cull(Tool& tool, Scene scene, const std::vector<Box>& boxes, PlacedScene& placed)
{
    for (const std::string& sun : loadSceneDome(scene)) // they throw shadows, too
        tool.say(sun);
    const std::size_t before = placed.boxes.size();
    tool.stats["culled"] = tool.stage("cull", [&](const Progress&) {
        return cullPlacements(placed.boxes, boxes, scene.camera, scene.render.width,
                              scene.render.height, scene.lights);
    });
    tool.say(fmt::format("{} of {} boxes matter to the picture", placed.boxes.size(), before));
}

/// Memory as a text, without numbers that mean nothing.
std::string megabytes(double mb)
{
    if (!(mb < 1e12)) return "more memory than any machine has";
    return mb > 100 && mb < 1e6 ? fmt::format("{:.0f} MB", mb) : fmt::format("{:.3g} MB", mb);
}

/// Returns a voxel that is sure to be too small for a volume that cannot even be counted.
double smallVoxel(const std::vector<Box>& boxes, double voxel)
{
    double finest = kInfinity;
    for (const Box& box : boxes) finest = std::min(finest, box.volume.voxelSize());
    return std::max(10 * voxel, std::isfinite(finest) ? 1e-3 * finest : 0);
}

/// Advises a voxel size whose estimate is below the limit, in MB, or says why there is none. Takes
/// about a second at most, if one estimate does.
std::string voxelAdvice(const std::vector<Box>& boxes, const PlacedScene& placed,
                        ComposeParams params, double limit, double needed)
{
    constexpr double kCpuSeconds = 0.5; // of all threads; the wall's depend on other programs
    constexpr double kHandful = 64;     // voxels; then the rest is what any composing needs
    const double asked = params.voxel, start = cpuSeconds();
    while (cpuSeconds() - start < kCpuSeconds) {
        // The memory falls with the third power of the voxel at most, so that this rarely jumps too
        // far.
        params.voxel = std::isfinite(needed)
            ? params.voxel * std::max(std::cbrt(needed / limit), 1.05)
            : smallVoxel(boxes, params.voxel);
        const ComposeEstimate estimate = estimateCompose(boxes, placed, params);
        needed = estimate.bytes / 1048576;
        if (needed <= limit)
            return fmt::format("A voxel of {:.3g} m instead of {:.3g} m would fit.", params.voxel,
                               asked);
        if (estimate.voxels <= kHandful)
            return fmt::format("No voxel size would fit: a handful of voxels needs about {}.",
                               megabytes(needed));
    }
    return fmt::format("A voxel of more than {:.3g} m would be needed instead of {:.3g} m.",
                       params.voxel, asked);
}

/// Throws Error if composing would need more memory than the limit.
void checkMemory(Tool& tool, const Scene& scene, const std::vector<Box>& boxes,
                 const PlacedScene& placed, const ComposeParams& params, double max_memory_mb)
{
    const double limit = max_memory_mb > 0 ? max_memory_mb : 0.75 * machineMegabytes();
    const ComposeEstimate estimate = tool.stage(
        "estimate", [&](const Progress&) { return estimateCompose(boxes, placed, params); });
    const double needed = estimate.bytes / 1048576;
    if (std::isfinite(estimate.voxels))
        tool.say(fmt::format("about {:.3g} voxels, {}", estimate.voxels, megabytes(needed)));
    tool.stats["estimate"] = {{"voxels", estimate.voxels}, {"mb", needed}};
    if (!(needed <= limit))
        throw fileError(scene.file, "compose",
                        fmt::format("a volume of at most {:.4g} MB (--max-memory)", limit),
                        needed < 1e12 ? "about " + megabytes(needed) : megabytes(needed),
                        voxelAdvice(boxes, placed, params, limit, needed));
}

} // namespace

Recipe composeRecipe(const Scene& scene, bool as_file)
{
    const ComposeParams& c = scene.compose;
    Recipe recipe;
    recipe.add("compose.voxel", fmt::format("{}", c.voxel));
    recipe.add("compose.voxel_pixels", fmt::format("{}", c.voxel_pixels));
    recipe.add("compose.keep", wordOf(kKeptWords, c.keep));
    recipe.add("compose.minimum_density", fmt::format("{}", c.minimum_density));
    if (!as_file) return recipe;
    recipe.add("compose.cull", c.cull ? "true" : "false");
    if (c.voxel > 0 && !c.cull) return recipe;
    recipe.add("camera", settingsOf(scene.camera).dump());
    recipe.add("render.width", std::to_string(scene.render.width));
    recipe.add("render.height", std::to_string(scene.render.height));
    if (!c.cull) return recipe;
    for (const Light& light : scene.lights)
        recipe.add("light." + light.name, settingsOf(light).dump());
    if (scene.render.dome.kind == DomeKind::image)
        recipe.addFile("dome.image content", scene.render.dome.file);
    return recipe;
}

void composeStage(Tool& tool, const Scene& scene, const std::vector<Box>& boxes, PlacedScene placed,
                  Recipe recipe, const ComposeToFile& to)
{
    ComposeParams params = scene.compose;
    params.voxel = voxelSize(tool, scene, placed, boxes);
    if (params.cull) cull(tool, scene, boxes, placed);
    checkMemory(tool, scene, boxes, placed, params, to.max_memory_mb);
    const PackedVolume volume =
        tool.stage("compose", [&](const Progress& p) { return compose(boxes, placed, params, p); });
    if (volume.voxels() == 0)
        tool.say(skinRecipe(scene).empty()
                     ? "the volume has no voxels"
                     : "the volume has no voxels: a picture of it shows the skins that "
                       "volcomp-render traces, and nothing else");
    tool.say(fmt::format("{} placements, {} voxels of {:.4g} m, {:.0f} MB", placed.boxes.size(),
                         volume.voxels(), params.voxel, double(volume.bytes()) / 1048576));
    tool.stats["placements"] = placed.boxes.size();
    tool.stats["voxel_m"] = params.voxel;
    tool.stats["active_voxels"] = volume.voxels();
    tool.stats["volume_bytes"] = volume.bytes();
    recipe.add(std::string(kOption) + "voxel", fmt::format("{}", params.voxel));
    const Recipe asked = composeRecipe(scene, true);
    for (const auto& [name, value] : asked.entries()) recipe.add(kOption + name, value);
    openvdb::MetaMap about;
    about.insertMeta(kRecipe, openvdb::StringMetadata(recipe.text()));
    tool.stage("write",
               [&](const Progress&) { writeVolume(to.output, volume, about, to.grid_names); });
}

} // namespace volcomp
