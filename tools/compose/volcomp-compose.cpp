// SPDX-License-Identifier: Apache-2.0
// volcomp-compose: a scene and its boxes become one sparse volume.
#include "tools/compose/compose_stage.h"
#include "tools/compose/view_stage.h"
#include "tools/shared/choice.h"
#include "tools/shared/leave_out.h"
#include "tools/shared/numbers.h"
#include "tools/shared/place_stage.h"
#include "tools/shared/read_boxes.h"
#include "volcomp/scene/scene_inputs.h"
#include "tools/shared/scene_option.h"
#include "tools/shared/stale.h"
#include "tools/shared/tool.h"
#include "volcomp/base/error.h"
#include "volcomp/place/placements_io.h"
#include "volcomp/scene/scene.h"
#include "volcomp/scene/scene_recipe.h"
#include "volcomp/volume/vdb_io.h"

namespace {

using namespace volcomp;
namespace fs = std::filesystem;

struct Options {
    fs::path output, boxes;
    fs::path placements;
    std::vector<std::string> leave_out;
    GridNames grid_names = GridNames::houdini;
    double voxel = 0, max_memory_mb = 0;
    bool camera = false;
    Stale stale = Stale::refused;
};

/// Throws Error if an output cannot be written, or is an input.
void requireOutputs(const Tool& tool, const Options& options, const Scene& scene)
{
    std::vector<NamedFile> inputs = inputsOf(scene);
    const std::vector<NamedFile> boxes = boxFiles(scene, options.boxes);
    inputs.insert(inputs.end(), boxes.begin(), boxes.end());
    constexpr int kMostLevels = 40;
    std::vector<NamedFile> outputs{{"--placements", options.placements}};
    if (!options.camera) outputs.push_back({"-o", options.output});
    for (int n = 0; n < (options.camera ? kMostLevels : 0); ++n)
        outputs.push_back({"-o", levelFile(options.output, n)});
    tool.requireFiles(inputs, outputs);
}

/// Writes the placements if the options ask for them.
void writePlaced(Tool& tool, const Options& options, const PlacedScene& placed,
                 const std::string& recipe)
{
    if (!options.placements.empty())
        tool.stage("write placements",
                   [&](const Progress&) { writePlacements(options.placements, placed, recipe); });
}

/// Reads the scene, changed as the options say, and prints its warnings.
Scene sceneOf(const Tool& tool, const SceneOption& file, const Options& options)
{
    Scene scene = file.read(tool);
    leaveOut(scene, options.leave_out);
    if (options.voxel > 0) scene.compose.voxel = options.voxel;
    return scene;
}

void run(Tool& tool, const SceneOption& file, const Options& options)
{
    if (!options.placements.empty()) requirePlacementsName(options.placements);
    const Scene scene = sceneOf(tool, file, options);
    requireOutputs(tool, options, scene);
    if (options.camera) {
        viewStage(tool, scene,
                  {options.output, options.boxes, options.stale, options.grid_names,
                   options.max_memory_mb});
        return;
    }
    const ReadBoxes read = tool.stage("read boxes", [&](const Progress& p) {
        return readBoxes(tool, scene, options.boxes, options.stale, p);
    });
    Recipe recipe = volumeRecipe(scene, read.used, options.leave_out);
    tool.stats["recipe"] = recipe.hash();
    PlaceOptions place_options;
    place_options.keep_uvs = !options.placements.empty();
    PlacedScene placed = placeStage(tool, scene, place_options);
    writePlaced(tool, options, placed, recipe.hash());
    if (options.output.empty()) return;

    composeStage(tool, scene, read.boxes, std::move(placed), std::move(recipe),
                 {options.output, options.grid_names, options.max_memory_mb});
}

} // namespace

int main(int argc, char** argv)
{
    Tool tool("volcomp-compose",
              "Places the scene's boxes on its surfaces and adds them into one sparse volume");
    Options options;
    const SceneOption scene(tool.app);
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
        .add_flag(
            "--camera", options.camera,
            "Write a volume for each level of voxels that the scene's camera looks at instead, "
            "as fine as its pixels: VOLUME.level0.vdb, near by, and on. Together they hold "
            "everything once. --max-memory bounds the whole program then")
        ->needs("--output")
        ->excludes("--placements")
        ->excludes("--leave-out");
    addAllowStale(tool.app, options.stale);
    return tool.main(argc, argv, [&] {
        if (options.output.empty() && options.placements.empty())
            throw Error("nothing to write: expected -o or --placements");
        run(tool, scene, options);
    });
}
