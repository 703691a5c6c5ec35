// SPDX-License-Identifier: Apache-2.0
// volcomp-compose: a scene and its boxes become one sparse volume.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "tools/shared/choice.h"
#include "tools/shared/leave_out.h"
#include "tools/shared/memory.h"
#include "tools/shared/numbers.h"
#include "tools/shared/place_stage.h"
#include "tools/shared/read_boxes.h"
#include "volcomp/scene/scene_inputs.h"
#include "tools/shared/stale.h"
#include "tools/shared/tool.h"
#include "volcomp/base/clock.h"
#include "volcomp/base/error.h"
#include "volcomp/base/interval.h"
#include "volcomp/compose/compose.h"
#include "volcomp/inspect/placement_sheet.h"
#include "volcomp/place/culling.h"
#include "volcomp/place/placements_io.h"
#include "volcomp/scene/place_scene.h"
#include "volcomp/scene/scene.h"
#include "volcomp/scene/scene_dome.h"
#include "volcomp/scene/scene_recipe.h"
#include "volcomp/view/image.h"
#include "volcomp/volume/vdb_io.h"

namespace {

using namespace volcomp;
namespace fs = std::filesystem;

struct Options {
    fs::path scene, output, boxes;
    fs::path placements, sheet;
    std::vector<std::string> leave_out;
    GridNames grid_names = GridNames::houdini;
    double voxel = 0, max_memory_mb = 0;
    Stale stale = Stale::refused;
};

/// Throws Error if an output cannot be written, or is an input.
void requireOutputs(const Tool& tool, const Options& options, const Scene& scene)
{
    std::vector<NamedFile> inputs = inputsOf(scene);
    const std::vector<NamedFile> boxes = boxFiles(scene, options.boxes);
    inputs.insert(inputs.end(), boxes.begin(), boxes.end());
    tool.requireFiles(
        inputs,
        {{"-o", options.output}, {"--placements", options.placements}, {"--sheet", options.sheet}});
}

/// Writes the placements and the sheet if the options ask for them.
void writePlaced(Tool& tool, const Options& options, const Scene& scene, const PlacedScene& placed,
                 const std::string& recipe)
{
    if (!options.placements.empty())
        tool.stage("write placements",
                   [&](const Progress&) { writePlacements(options.placements, placed, recipe); });
    if (!options.sheet.empty())
        tool.stage("sheet", [&](const Progress&) {
            writeImage(
                options.sheet,
                placementSheet(placed, scene.camera, scene.render.width, scene.render.height),
                {{"volcomp/recipe", recipe}});
        });
}

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
void checkMemory(Tool& tool, const Options& options, const std::vector<Box>& boxes,
                 const PlacedScene& placed, const ComposeParams& params)
{
    const double limit =
        options.max_memory_mb > 0 ? options.max_memory_mb : 0.75 * machineMegabytes();
    const ComposeEstimate estimate = tool.stage(
        "estimate", [&](const Progress&) { return estimateCompose(boxes, placed, params); });
    const double needed = estimate.bytes / 1048576;
    if (std::isfinite(estimate.voxels))
        tool.say(fmt::format("about {:.3g} voxels, {}", estimate.voxels, megabytes(needed)));
    tool.stats["estimate"] = {{"voxels", estimate.voxels}, {"mb", needed}};
    if (!(needed <= limit))
        throw fileError(options.scene, "compose",
                        fmt::format("a volume of at most {:.4g} MB (--max-memory)", limit),
                        needed < 1e12 ? "about " + megabytes(needed) : megabytes(needed),
                        voxelAdvice(boxes, placed, params, limit, needed));
}

/// Reads the scene, changed as the options say, and prints its warnings.
Scene sceneOf(const Tool& tool, const Options& options)
{
    Scene scene = readScene(options.scene);
    for (const std::string& warning : scene.warnings) tool.warn(warning);
    leaveOut(scene, options.leave_out);
    if (options.voxel > 0) scene.compose.voxel = options.voxel;
    return scene;
}

void run(Tool& tool, const Options& options)
{
    if (!options.placements.empty()) requirePlacementsName(options.placements);
    if (!options.sheet.empty()) requirePictureName(options.sheet);
    const Scene scene = sceneOf(tool, options);
    requireOutputs(tool, options, scene);
    const ReadBoxes read = tool.stage("read boxes", [&](const Progress& p) {
        return readBoxes(tool, scene, options.boxes, options.stale, p);
    });
    const std::vector<Box>& boxes = read.boxes;
    Recipe recipe = volumeRecipe(scene, read.used, options.leave_out);
    tool.stats["recipe"] = recipe.hash();
    PlaceOptions place_options;
    place_options.keep_uvs = !options.placements.empty();
    PlacedScene placed = placeStage(tool, scene, place_options);
    writePlaced(tool, options, scene, placed, recipe.hash());
    if (options.output.empty()) return;

    ComposeParams params = scene.compose;
    params.voxel = voxelSize(tool, scene, placed, boxes);
    if (params.cull) cull(tool, scene, boxes, placed);
    checkMemory(tool, options, boxes, placed, params);
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
    openvdb::MetaMap about;
    about.insertMeta(kRecipe, openvdb::StringMetadata(recipe.text()));
    tool.stage("write", [&](const Progress&) {
        writeVolume(options.output, volume, about, options.grid_names);
    });
}

} // namespace

int main(int argc, char** argv)
{
    Tool tool("volcomp-compose",
              "Places the scene's boxes on its surfaces and adds them into one sparse volume");
    Options options;
    tool.app.add_option("scene", options.scene, "Scene file (TOML)")
        ->required()
        ->type_name("SCENE");
    tool.app.add_option("-o,--output", options.output, "Volume to write")->type_name("VOLUME.vdb");
    tool.app.add_option("--boxes", options.boxes, "Directory of the boxes that volcomp-bake wrote")
        ->required()
        ->type_name("DIR");
    tool.app
        .add_option("--voxel", options.voxel,
                    "Edge of a voxel in metres; 0: compose.voxel of the scene")
        ->capture_default_str()
        ->check(realNumber(0));
    tool.app
        .add_option("--max-memory", options.max_memory_mb,
                    "Refuse a volume that needs more, in MB; 0: 3/4 of the machine's memory")
        ->capture_default_str()
        ->check(realNumber(0));
    tool.app
        .add_option(
            "--leave-out", options.leave_out,
            "Compose without this surface and the layers on it; may be given more than once")
        ->type_name("SURFACE")
        ->allow_extra_args(false);
    addChoice(tool.app, "--grid-names", options.grid_names,
              "Name of the colour's grid: Cd as in Houdini (the default), or color as in Blender",
              kGridNamesWords);
    tool.app.add_option("--placements", options.placements, "Also write where the boxes stand")
        ->type_name("FILE.json|.ply|.usda");
    tool.app
        .add_option(
            "--sheet", options.sheet,
            "Also write a picture of the placements and of each map as it falls on the surface")
        ->type_name("FILE.png");
    addAllowStale(tool.app, options.stale);
    return tool.main(argc, argv, [&] {
        if (options.output.empty() && options.placements.empty() && options.sheet.empty())
            throw Error("nothing to write: expected -o, --placements or --sheet");
        run(tool, options);
    });
}
