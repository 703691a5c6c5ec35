// SPDX-License-Identifier: Apache-2.0
// volcomp-render: makes a picture of a volume file with a scene's camera and lights.
#include <algorithm>
#include <iostream>

#include <fmt/format.h>

#include "tools/render/checkpoint.h"
#include "tools/render/flight.h"
#include "volcomp/base/error.h"
#include "volcomp/render/explain.h"
#include "volcomp/render/render.h"
#include "tools/render/render_options.h"
#include "tools/render/render_stage.h"
#include "tools/shared/rendered_volume.h"
#include "tools/shared/numbers.h"
#include "volcomp/scene/scene_inputs.h"
#include "volcomp/scene/scene.h"
#include "volcomp/scene/scene_dome.h"
#include "volcomp/scene/scene_recipe.h"
#include "tools/shared/scene_option.h"
#include "tools/shared/settings.h"
#include "tools/shared/stale.h"
#include "tools/shared/tool.h"
#include "volcomp/volume/vdb_io.h"
#include "volcomp/render/tree/voxel_levels.h"
#include "volcomp/render/tree/voxel_tree_io.h"

namespace {

using namespace volcomp;
namespace fs = std::filesystem;

struct Options {
    fs::path volume, boxes, cameras;
    PictureFiles files;
    std::string explain; ///< X,Y, or empty
    std::string grid;    ///< of the volume, or empty
    double max_memory_mb = 0;
    Stale stale = Stale::refused;
};

/// The volume that the options name, or else the one beside the first picture.
fs::path volumeOf(const Options& options)
{
    if (!options.volume.empty()) return options.volume;
    if (options.files.outputs.empty())
        throw Error("--explain: expected --volume FILE.vdb, or -o PICTURE beside which volume.vdb "
                    "lies, found neither");
    return options.files.outputs[0].parent_path() / "volume.vdb";
}

/// Throws Error if an output cannot be written, or is an input.
void requireOutputs(const Tool& tool, const Options& options, const Scene& scene,
                    std::size_t cameras, const fs::path& volume)
{
    std::vector<NamedFile> inputs = inputsOf(scene), outputs;
    if (options.boxes.empty()) inputs.push_back({"the volume", volume});
    else
        for (const NamedFile& box : boxFiles(scene, options.boxes)) inputs.push_back(box);
    if (!options.cameras.empty()) inputs.push_back({"--cameras", options.cameras});
    for (const fs::path& output : options.files.outputs)
        for (std::size_t n = 1; n <= std::max<std::size_t>(cameras, 1); ++n)
            outputs.push_back({"-o", cameras > 0 ? frameFile(output, int(n)) : output});
    outputs.push_back({"--preview", options.files.preview});
    if (options.cameras.empty() && usesCheckpoint(options.files)) {
        const fs::path checkpoint = checkpointOf(options.files);
        std::error_code code;
        if (fs::exists(checkpoint, code) && !fs::is_regular_file(checkpoint, code))
            throw fileError(checkpoint, "", "the state of a stopped render, or no file",
                            "a directory, a pipe or a device",
                            "Remove it, or render with --checkpoint 0.");
        outputs.push_back({"the checkpoint", checkpoint});
    }
    tool.requireFiles(inputs, outputs);
}

/// Throws Error if the scene would compose another volume, unless that is allowed. A scene without
/// surfaces, layers and grooms, which shows any volume, and a volume without a recipe pass. Returns
/// the hash of the volume's recipe; empty if it has none. Takes the surfaces that were left out of
/// the volume out of the scene.
std::string checkedRecipe(const Tool& tool, Scene& scene, const fs::path& volume, Stale stale)
{
    const Recipe made = recipeOf(readVolumeMetadata(volume));
    if (made.empty()) return "";
    if (scene.surfaces.empty() && wantedBoxes(scene).empty()) return made.hash();
    for (const auto& [name, value] : made.entries())
        if (name == std::string(kOption) + "leave-out")
            static_cast<void>(removeSurface(scene, value)); // one that is gone is no difference
    requireFresh(tool, volume, made, placedRecipe(scene, wantedBoxes(scene)), stale,
                 "Compose it anew with volcomp-compose");
    return made.hash();
}

void explainPixel(Tool& tool, const Options& options, const Scene& scene,
                  const std::vector<VoxelLevel>& levels, const SkinTracer* skins)
{
    const Pixel pixel = readPixel("--explain", options.explain);
    const RayExplanation explanation = tool.stage("explain", [&](const Progress&) {
        return explain(levels, scene.materials, scene.camera, scene.lights, scene.render, pixel.x,
                       pixel.y, skins);
    });
    std::cout << explanationTable(explanation, scene.lights);
    if (!std::cout.flush()) throw Error("--explain: the table could not be written to the output");
}

/// The volume that the options name, from a file or from boxes. A file's voxels are not read yet.
RenderedVolume volumeFor(Tool& tool, const Options& options, const std::vector<Camera>& cameras,
                         Scene& scene)
{
    if (!options.boxes.empty())
        return volumeOfBoxes(tool, scene,
                             {options.boxes, options.stale, options.max_memory_mb, cameras});
    const fs::path file = volumeOf(options);
    RenderedVolume volume;
    volume.name = file.string();
    volume.recipe = checkedRecipe(tool, scene, file, options.stale);
    if (!options.files.outputs.empty()) volume.identity = fileIdentity(file, options.grid);
    return volume;
}

void run(Tool& tool, const SceneOption& file, const Options& options,
         const RenderOptions& overrides)
{
    for (const auto& output : options.files.outputs) requirePictureName(output);
    if (!options.files.preview.empty()) requirePictureName(options.files.preview);
    Scene scene = file.read(tool);
    overrides.apply(scene.render);
    warnIfDark(tool, scene);
    overrides.apply(scene.look);
    if (!options.explain.empty()) {
        const Pixel pixel = readPixel("--explain", options.explain);
        requirePixel(scene.render, pixel.x, pixel.y, "--explain");
    }

    std::vector<Camera> cameras;
    if (!options.cameras.empty()) cameras = readCameras(options.cameras, scene.camera);
    requireOutputs(tool, options, scene, cameras.size(),
                   options.boxes.empty() ? volumeOf(options) : fs::path());
    for (const std::string& sun : loadSceneDome(scene)) tool.say(sun);
    RenderedVolume volume = volumeFor(tool, options, cameras, scene);
    nlohmann::json fingerprint;
    RenderState state;
    if (!options.files.outputs.empty() && cameras.empty()) {
        fingerprint = renderFingerprint(scene, volume.identity);
        state = startingState(tool, options.files, fingerprint);
    }
    if (options.boxes.empty())
        volume.levels = tool.stage("load", [&](const Progress& progress) {
            return voxelLevels(std::make_shared<const VoxelTree>(
                                   readVoxelTree(volumeOf(options), progress, options.grid)),
                               scene.camera, scene.render);
        });
    const auto skins = skinStage(tool, scene);
    for (const VoxelLevel& level : volume.levels)
        for (const std::string& warning : level.tree->warnings()) tool.warn(warning);
    tool.stats["settings"] = settingsOf(scene.render);
    tool.stats["picture"] = lookOf(scene.look);
    if (!options.explain.empty()) explainPixel(tool, options, scene, volume.levels, skins.get());
    if (options.files.outputs.empty()) return;
    if (!cameras.empty()) {
        renderFlight(tool, scene, cameras, volume, skins.get(), options.files.outputs);
        return;
    }
    renderStage(tool, scene, volume, skins.get(), fingerprint, std::move(state), options.files);
}

/// The program's own options.
void addOptions(CLI::App& app, Options& options)
{
    app.add_option("-o,--output", options.files.outputs,
                   "Picture to write, .exr or .png; may be given more than once")
        ->type_name("PICTURE")
        ->allow_extra_args(false);
    app.add_option(
           "--volume", options.volume,
           "Volume to render, any fog volume (default: volume.vdb beside the first picture)")
        ->type_name("FILE.vdb");
    app.add_option("--boxes", options.boxes,
                   "Directory of the boxes that volcomp-bake wrote: renders the scene from them, "
                   "without a volume file. Voxels are made where rays look, of the size that the "
                   "pixel there can show (compose.voxel_pixels)")
        ->type_name("DIR")
        ->excludes("--volume");
    app.add_option(
           "--cameras", options.cameras,
           "With --boxes: a picture for each line of this file, eye x y z, target x y z and "
           "field of view in degrees, to the names of -o with the picture's number for #, as "
           "in flight.####.png. What was made for one picture serves the next")
        ->type_name("FILE")
        ->needs("--boxes");
    app.add_option("--max-memory", options.max_memory_mb,
                   "With --boxes: memory of the whole program, in MB; what is not needed any more "
                   "is let go of, and the picture stays the same; 0: half of the machine's")
        ->capture_default_str()
        ->check(realNumber(0));
    app.add_option("--grid", options.grid,
                   "Grid of the volume's file to take as the density (default: density)")
        ->type_name("NAME")
        ->excludes("--boxes");
    app.add_option("--explain", options.explain,
                   "Print what the ray through the middle of this pixel meets, and what each light "
                   "adds there; counted from the picture's top left corner. No picture is needed "
                   "then")
        ->type_name("X,Y");
    app.parse_complete_callback([&options] {
        if (options.files.outputs.empty() && options.explain.empty())
            throw CLI::RequiredError("--output");
    });
}

void addWatchOptions(CLI::App& app, Options& options)
{
    app.add_option("--preview", options.files.preview,
                   "Also write a coarse picture soon, .exr or .png, and a better one after each "
                   "pass")
        ->type_name("FILE");
    app.add_flag("--resume", options.files.resume,
                 "Go on where this render was stopped, to the same pixels");
    app.add_option("--checkpoint", options.files.checkpoint_seconds,
                   "Save what a stopped render goes on from (PICTURE.checkpoint) every so many "
                   "seconds; 0: never")
        ->capture_default_str()
        ->check(realNumber(0));
}

} // namespace

int main(int argc, char** argv)
{
    Tool tool("volcomp-render", "Renders the volume of a scene to a picture.");
    Options options;
    const SceneOption scene(tool.app);
    addOptions(tool.app, options);
    addAllowStale(tool.app, options.stale);
    const RenderOptions overrides(tool.app);
    addWatchOptions(tool.app, options);
    return tool.main(argc, argv, [&] { run(tool, scene, options, overrides); });
}
