// SPDX-License-Identifier: Apache-2.0
// volcomp-render: makes a picture of a volume file with a scene's camera and lights.
#include <csignal>
#include <iostream>
#include <optional>

#include <fmt/format.h>

#include "tools/render/checkpoint.h"
#include "tools/render/flight.h"
#include "volcomp/base/clock.h"
#include "volcomp/base/error.h"
#include "volcomp/base/hash.h"
#include "volcomp/view/image.h"
#include "volcomp/render/explain.h"
#include "volcomp/render/render.h"
#include "tools/render/light_report.h"
#include "tools/render/render_options.h"
#include "tools/render/rendered_volume.h"
#include "tools/shared/numbers.h"
#include "volcomp/scene/scene_inputs.h"
#include "volcomp/scene/scene.h"
#include "volcomp/scene/scene_dome.h"
#include "volcomp/scene/scene_recipe.h"
#include "volcomp/scene/scene_skins.h"
#include "tools/shared/settings.h"
#include "tools/shared/stale.h"
#include "tools/shared/tool.h"
#include "volcomp/volume/vdb_io.h"
#include "volcomp/render/tree/voxel_levels.h"
#include "volcomp/render/tree/voxel_tree_io.h"

namespace {

using namespace volcomp;
namespace fs = std::filesystem;

std::atomic<bool> stop_asked{false};

/// During its lifetime the first SIGTERM or SIGINT asks the render to stop and save; a second one
/// ends the program at once.
class StopOnSignal {
public:
    StopOnSignal()
    {
        struct sigaction action { };
        action.sa_handler = [](int) { stop_asked = true; };
        action.sa_flags = SA_RESETHAND;
        for (const int signal : {SIGTERM, SIGINT}) sigaction(signal, &action, nullptr);
    }
    ~StopOnSignal()
    {
        for (const int signal : {SIGTERM, SIGINT}) std::signal(signal, SIG_DFL);
    }
};

struct Options {
    fs::path scene, volume, boxes, cameras, preview;
    std::vector<fs::path> outputs;
    std::string explain; ///< X,Y, or empty
    std::string grid;    ///< of the volume, or empty
    bool resume = false;
    double checkpoint_seconds = 20, max_memory_mb = 0;
    Stale stale = Stale::refused;
};

/// Calls write(). If it fails, warns that the render goes on without `what`, the first time only,
/// and returns false: neither a full disk nor a folder that went away ends a long render.
bool attempt(const Tool& tool, const std::string& what, bool& warned,
             const std::function<void()>& write)
{
    try {
        write();
        return true;
    } catch (const std::exception& e) {
        if (!warned) tool.warn(what + " could not be written, the render goes on: " + e.what());
        warned = true;
        return false;
    }
}

/// Renders with pauses in which the preview and the checkpoint are written.
Image renderWatched(Tool& tool, const Options& options, const Scene& scene,
                    const std::vector<VoxelLevel>& levels, const SkinTracer* skins,
                    const fs::path& checkpoint, RenderState state,
                    const nlohmann::json& fingerprint, RenderStats& stats)
{
    const bool saves = options.checkpoint_seconds > 0;
    double saved = wallSeconds();
    bool preview_warned = false, checkpoint_warned = false, kept = false;
    RenderWatch watch;
    watch.state = std::move(state);
    watch.preview = !options.preview.empty();
    watch.every_seconds = saves ? std::min(10.0, options.checkpoint_seconds) : 10;
    watch.stop = saves ? &stop_asked : nullptr;
    watch.update = [&](const RenderState& so_far, const Image& image) {
        if (!options.preview.empty())
            attempt(tool, "the preview", preview_warned,
                    [&] { writeImage(options.preview, image, {}, scene.look); });
        if (!saves || (!stop_asked && wallSeconds() - saved < options.checkpoint_seconds)) return;
        kept = attempt(tool, "the checkpoint", checkpoint_warned,
                       [&] { writeCheckpoint(checkpoint, fingerprint, so_far); });
        saved = wallSeconds();
    };
    return tool.stage("render", [&](const Progress& progress) {
        std::optional<StopOnSignal> handler;
        if (saves) handler.emplace();
        try {
            return render(levels, scene.materials, scene.camera, scene.lights, scene.render,
                          progress, &stats, &watch, skins);
        } catch (const Stopped& e) {
            throw Error(
                std::string(e.what())
                + (kept ? "; the same command with --resume goes on from " + checkpoint.string()
                        : "; nothing of it could be kept"));
        }
    });
}

void writePictures(const Tool& tool, const Options& options, const std::string& volume,
                   const std::string& recipe, const nlohmann::json& settings, const Look& look,
                   const RenderStats& stats, const Image& image)
{
    std::vector<std::pair<std::string, std::string>> about{
        {"Software", "volcomp"},
        {"volcomp/scene", options.scene.string()},
        {"volcomp/volume", volume},
        {"volcomp/recipe", recipe},
        {"volcomp/settings", settings.dump()}};
    for (const auto& output : options.outputs)
        if (!requirePictureName(output)) { // the same bytes whenever it is rendered
            auto png = about;
            if (look != Look()) png.emplace_back("volcomp/picture", lookOf(look).dump());
            writeImage(output, image, png, look);
        }
    about.emplace_back("volcomp/seconds",
                       fmt::format("{:.2f}", stats.prepare_seconds + stats.march_seconds));
    for (const auto& output : options.outputs)
        if (requirePictureName(output)) writeImage(output, image, about);
    bool warned = false;
    if (!options.preview.empty())
        attempt(tool, "the preview", warned, [&] { writeImage(options.preview, image, {}, look); });
}

/// The volume that the options name, or else the one beside the first picture.
fs::path volumeOf(const Options& options)
{
    if (!options.volume.empty()) return options.volume;
    if (options.outputs.empty())
        throw Error("--explain: expected --volume FILE.vdb, or -o PICTURE beside which volume.vdb "
                    "lies, found neither");
    return options.outputs[0].parent_path() / "volume.vdb";
}

/// The file that keeps the state of a stopped render; no path if there is no picture.
fs::path checkpointOf(const Options& options)
{
    return options.outputs.empty() ? fs::path()
                                   : fs::path(options.outputs[0].string() + ".checkpoint");
}

/// Whether this run reads or writes the checkpoint.
bool usesCheckpoint(const Options& options)
{
    return options.cameras.empty() && !options.outputs.empty()
        && (options.resume || options.checkpoint_seconds > 0);
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
    for (const fs::path& output : options.outputs)
        for (std::size_t n = 1; n <= std::max<std::size_t>(cameras, 1); ++n)
            outputs.push_back({"-o", cameras > 0 ? frameFile(output, int(n)) : output});
    outputs.push_back({"--preview", options.preview});
    if (usesCheckpoint(options)) {
        const fs::path checkpoint = checkpointOf(options);
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

/// What a stopped render left, if it is to be gone on with; otherwise the start.
RenderState startingState(const Tool& tool, const Options& options, const fs::path& checkpoint,
                          const nlohmann::json& fingerprint)
{
    if (options.resume && fs::exists(checkpoint)) {
        tool.say("going on from " + checkpoint.string());
        return readCheckpoint(checkpoint, fingerprint);
    }
    if (options.resume) tool.say("no " + checkpoint.string() + ": starting at the beginning");
    else if (fs::exists(checkpoint))
        tool.warn(
            checkpoint.string()
            + " holds a stopped render, which --resume would go on with; this one starts anew");
    return {};
}

/// The skins that are meshes; null if there are none.
std::unique_ptr<const SkinTracer> skinsOf(Tool& tool, const Scene& scene)
{
    if (skinRecipe(scene).empty()) return nullptr;
    auto skins = tool.stage("skins", [&](const Progress& p) { return loadSkins(scene, p); });
    tool.stats["skins"] = {{"meshes", skins->meshes().size()}, {"triangles", skins->triangles()}};
    return skins;
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

nlohmann::json asJson(const RenderStats& stats, const std::vector<VoxelLevel>& levels)
{
    std::size_t bytes = 0;
    for (const VoxelLevel& level : levels) bytes += level.tree->memoryBytes();
    return {{"rays", stats.rays},
            {"shadow_rays", stats.shadow_rays},
            {"shaded_voxels", stats.shaded_voxels},
            {"active_voxels", stats.active_voxels},
            {"volume_bytes", bytes},
            {"skin_shadow_bytes", stats.skin_shadow_bytes},
            {"openness_bytes", stats.openness_bytes},
            {"openness_seconds", stats.openness_seconds},
            {"prepare_seconds", stats.prepare_seconds},
            {"march_seconds", stats.march_seconds}};
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
    if (!options.outputs.empty()) volume.identity = fileIdentity(file, options.grid);
    return volume;
}

void run(Tool& tool, const Options& options, const RenderOptions& overrides)
{
    for (const auto& output : options.outputs) requirePictureName(output);
    if (!options.preview.empty()) requirePictureName(options.preview);
    Scene scene = readScene(options.scene);
    for (const std::string& warning : scene.warnings) tool.warn(warning);
    overrides.apply(scene.render);
    if (scene.lights.empty() && scene.render.ambient == Vec3d(0.0) && scene.render.dome.black())
        tool.warn(options.scene.string()
                  + ": no [[light]], no [dome] and no ambient light: the volume will be black");
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
    const fs::path checkpoint = checkpointOf(options);
    nlohmann::json fingerprint;
    RenderState state;
    if (!options.outputs.empty() && cameras.empty()) {
        fingerprint = renderFingerprint(scene, volume.identity);
        state = startingState(tool, options, checkpoint, fingerprint);
    }
    if (options.boxes.empty())
        volume.levels = tool.stage("load", [&](const Progress& progress) {
            return voxelLevels(std::make_shared<const VoxelTree>(
                                   readVoxelTree(volumeOf(options), progress, options.grid)),
                               scene.camera, scene.render);
        });
    const auto skins = skinsOf(tool, scene);
    for (const VoxelLevel& level : volume.levels)
        for (const std::string& warning : level.tree->warnings()) tool.warn(warning);
    tool.stats["settings"] = settingsOf(scene.render);
    tool.stats["picture"] = lookOf(scene.look);
    if (!options.explain.empty()) explainPixel(tool, options, scene, volume.levels, skins.get());
    if (options.outputs.empty()) return;
    if (!cameras.empty()) {
        renderFlight(tool, scene, cameras, volume, skins.get(), options.outputs);
        return;
    }

    RenderStats stats;
    const Image image = renderWatched(tool, options, scene, volume.levels, skins.get(), checkpoint,
                                      std::move(state), fingerprint, stats);
    tool.stats["render"] = asJson(stats, volume.levels);
    tool.stats["light"] = lightStats(scene.lights, stats);
    tool.say(fmt::format("{} rays, {} shadow rays, {} shaded voxels in {:.2f} s, {} voxels",
                         stats.rays, stats.shadow_rays, stats.shaded_voxels, stats.march_seconds,
                         stats.active_voxels));
    reportTiles(tool, volume);
    if (stats.openness_bytes > 0)
        tool.say(fmt::format("openness: {:.1f} MB in {:.2f} s", 1e-6 * double(stats.openness_bytes),
                             stats.openness_seconds));
    // The volume's own identity differs between machines; its recipe does not.
    nlohmann::json ingredients = fingerprint;
    if (options.boxes.empty())
        ingredients["volume"] =
            volume.recipe.empty() ? fingerprint["volume"]["file"].dump() : volume.recipe;
    const std::string recipe = fmt::format("{:016x}", fnv1a(ingredients.dump()));
    tool.stats["recipe"] = recipe;
    tool.stage("write", [&](const Progress&) {
        writePictures(tool, options, volume.name, recipe, tool.stats["settings"], scene.look, stats,
                      image);
    });
    std::error_code ignored;
    if (usesCheckpoint(options)) fs::remove(checkpoint, ignored);
    for (const auto& output : options.outputs) tool.say("wrote " + output.string());
    for (const std::string& line : lightReport(scene.lights, stats)) tool.say(line);
}

/// The program's own options.
void addOptions(CLI::App& app, Options& options)
{
    app.add_option("scene", options.scene, "Scene file (TOML)")->required()->type_name("SCENE");
    app.add_option("-o,--output", options.outputs,
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
        if (options.outputs.empty() && options.explain.empty())
            throw CLI::RequiredError("--output");
    });
}

void addWatchOptions(CLI::App& app, Options& options)
{
    app.add_option("--preview", options.preview,
                   "Also write a coarse picture soon, .exr or .png, and a better one after each "
                   "pass")
        ->type_name("FILE");
    app.add_flag("--resume", options.resume,
                 "Go on where this render was stopped, to the same pixels");
    app.add_option("--checkpoint", options.checkpoint_seconds,
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
    addOptions(tool.app, options);
    addAllowStale(tool.app, options.stale);
    const RenderOptions overrides(tool.app);
    addWatchOptions(tool.app, options);
    return tool.main(argc, argv, [&] { run(tool, options, overrides); });
}
