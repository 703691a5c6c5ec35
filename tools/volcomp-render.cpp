// volcomp-render: a volume file and a scene's camera and lights to a picture.
#include <chrono>
#include <csignal>
#include <cstdio>
#include <map>
#include <optional>

#include <fmt/format.h>

#include "checkpoint.h"
#include "error.h"
#include "image.h"
#include "render.h"
#include "scene.h"
#include "settings.h"
#include "tool.h"
#include "vdb_io.h"
#include "voxel_tree.h"

using namespace volcomp;

namespace {

std::atomic<bool> stop_asked{false};

/// While it lives, the first SIGTERM or SIGINT asks the render to stop and save; a second one ends the program at once.
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

} // namespace

int main(int argc, char** argv)
{
    Tool tool("volcomp-render", "Renders the volume of a scene to a picture.");
    std::filesystem::path scene_file, volume_file;
    std::vector<std::filesystem::path> outputs;
    std::string size, crop;
    int samples = 0;
    tool.app.add_option("scene", scene_file, "Scene file (TOML)")->required()->type_name("SCENE");
    tool.app.add_option("-o,--output", outputs, "Picture to write, .exr or .png; may be given more than once")
        ->required()
        ->type_name("PICTURE")
        ->allow_extra_args(false);
    tool.app.add_option("--volume", volume_file, "Volume to render, any fog volume (default: volume.vdb beside the first picture)")
        ->type_name("FILE.vdb");
    tool.app.add_option("--size", size, "Size of the picture, pixels (default: the scene's)")->type_name("WxH");
    tool.app.add_option("--samples", samples, "Samples per pixel (default: the scene's)")->check(CLI::Range(1, 65536));
    tool.app.add_option("--crop", crop, "Render only this rectangle, pixels from the top left corner")->type_name("X,Y,W,H");
    std::filesystem::path preview;
    bool resume = false;
    double checkpoint_seconds = 20;
    tool.app.add_option("--preview", preview, "Also write a coarse picture soon, .exr or .png, and a better one after each pass")
        ->type_name("FILE");
    tool.app.add_flag("--resume", resume, "Go on where this render was stopped, to the same pixels");
    tool.app
        .add_option("--checkpoint", checkpoint_seconds,
                    "Save what a stopped render goes on from (PICTURE.checkpoint) every so many seconds; 0: never")
        ->capture_default_str()
        ->check(CLI::NonNegativeNumber);
    std::optional<PixelFilter> pixel_filter;
    std::optional<double> pixel_radius;
    std::optional<Shadows> shadows;
    std::optional<Integration> integration;
    std::optional<Filter> filter;
    std::optional<Extinction> extinction;
    std::optional<double> step, cutoff;
    const auto choice = [&](const char* name, auto& value, const char* meaning, auto words) {
        std::string names;
        for (const auto& word : words) names += (names.empty() ? "" : "|") + word.first;
        tool.app
            .add_option_function<std::string>(
                name,
                [&value, words, names, name](const std::string& text) {
                    const auto found = words.find(text);
                    if (found == words.end()) throw CLI::ValidationError(name, "expected " + names + ", found '" + text + "'");
                    value = found->second;
                },
                meaning)
            ->type_name(names);
    };
    choice("--shadows", shadows, "Light on its way to a voxel (default: the scene's)",
           std::map<std::string, Shadows>{{"exact", Shadows::exact}, {"sweep", Shadows::sweep}, {"none", Shadows::none}});
    choice("--integration", integration, "Closed form, or the paper's sums (default: the scene's)",
           std::map<std::string, Integration>{{"exact", Integration::exact}, {"riemann", Integration::riemann}});
    choice("--filter", filter, "Density between voxel centres (default: the scene's)",
           std::map<std::string, Filter>{{"box", Filter::box}, {"trilinear", Filter::trilinear}});
    choice("--extinction", extinction, "Whether fibres cover less seen end on (default: the scene's)",
           std::map<std::string, Extinction>{{"isotropic", Extinction::isotropic}, {"fibre", Extinction::fibre}});
    choice("--pixel-filter", pixel_filter, "How the samples around a pixel are weighed (default: the scene's)",
           std::map<std::string, PixelFilter>{
               {"box", PixelFilter::box}, {"gaussian", PixelFilter::gaussian}, {"blackman-harris", PixelFilter::blackman_harris}});
    tool.app.add_option("--pixel-radius", pixel_radius, "Of that filter, pixels (default: the scene's)")->check(CLI::Range(0.0, 16.0));
    std::optional<bool> lod;
    tool.app.add_flag_function(
        "--lod,!--no-lod", [&](std::int64_t n) { lod = n > 0; },
        "Coarser voxels where they are smaller than pixels (default: the scene's)");
    tool.app.add_option("--step", step, "Step of the sums, voxels (default: the scene's)")->check(CLI::Range(0.001, 1000.0));
    tool.app
        .add_option(
            "--cutoff", cutoff,
            "Rays end where a smaller fraction of light passes; no radiance is off by more than this fraction of the brightest voxel's (default: the scene's)")
        ->check(CLI::Range(0.0, 0.99));
    return tool.main(argc, argv, [&] {
        for (const auto& output : outputs) isExrName(output);
        if (!preview.empty()) isExrName(preview);
        Scene scene = readScene(scene_file);
        if (scene.lights.empty() && scene.render.ambient == Vec3d(0.0))
            tool.warn(scene_file.string() + ": no [[light]] and no ambient light: everything in the picture will be black");
        RenderParams& params = scene.render;
        char rest = 0;
        if (!size.empty()
            && (std::sscanf(size.c_str(), "%dx%d%c", &params.width, &params.height, &rest) != 2 || params.width < 1 || params.height < 1))
            throw Error("--size: expected WIDTHxHEIGHT in pixels, such as 640x480, found '" + size + "'");
        if (samples > 0) params.samples = samples;
        params.pixel_filter = pixel_filter.value_or(params.pixel_filter);
        params.pixel_radius = pixel_radius.value_or(params.pixel_radius);
        params.shadows = shadows.value_or(params.shadows);
        params.integration = integration.value_or(params.integration);
        params.filter = filter.value_or(params.filter);
        params.extinction = extinction.value_or(params.extinction);
        params.lod = lod.value_or(params.lod);
        params.step = step.value_or(params.step);
        params.cutoff = cutoff.value_or(params.cutoff);
        if (!crop.empty()) {
            Crop& c = params.crop;
            if (std::sscanf(crop.c_str(), "%d,%d,%d,%d%c", &c.x, &c.y, &c.width, &c.height, &rest) != 4)
                throw Error("--crop: expected X,Y,WIDTH,HEIGHT in pixels, such as 100,50,64,64, found '" + crop + "'");
        }
        if (volume_file.empty()) volume_file = outputs[0].parent_path() / "volume.vdb";
        const std::filesystem::path checkpoint = outputs[0].string() + ".checkpoint";
        const nlohmann::json fingerprint = renderFingerprint(scene, volume_file);
        RenderWatch watch;
        if (resume && std::filesystem::exists(checkpoint)) {
            watch.state = readCheckpoint(checkpoint, fingerprint);
            tool.say("going on from " + checkpoint.string());
        } else if (resume) tool.say("no " + checkpoint.string() + ": starting at the beginning");
        else if (std::filesystem::exists(checkpoint))
            tool.warn(checkpoint.string() + " holds a stopped render, which --resume would go on with; this one starts anew");
        const VoxelTree tree = tool.stage("load", [&](const Progress& progress) { return readVoxelTree(volume_file, progress); });
        const auto save = [&](const RenderState& state) { writeCheckpoint(checkpoint, fingerprint, state); };
        const auto now = [] { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); };
        double saved = now();
        watch.preview = !preview.empty();
        watch.every_seconds = checkpoint_seconds > 0 ? std::min(10.0, checkpoint_seconds) : 10;
        watch.stop = checkpoint_seconds > 0 ? &stop_asked : nullptr;
        watch.update = [&](const RenderState& state, const Image& so_far) {
            if (!preview.empty()) writeImage(preview, so_far);
            if (checkpoint_seconds == 0 || (!stop_asked && now() - saved < checkpoint_seconds)) return;
            save(state);
            saved = now();
        };
        RenderStats stats;
        const Image image = tool.stage("render", [&](const Progress& progress) {
            std::optional<StopOnSignal> handler;
            if (checkpoint_seconds > 0) handler.emplace();
            try {
                return render(tree, scene.materials, scene.camera, scene.lights, params, progress, &stats, &watch);
            } catch (const Stopped& e) {
                throw Error(std::string(e.what()) + "; the same command with --resume goes on from " + checkpoint.string());
            }
        });
        tool.stats["settings"] = settingsOf(params);
        tool.stats["render"] = {{"rays", stats.rays},
                                {"shadow_rays", stats.shadow_rays},
                                {"shaded_voxels", stats.shaded_voxels},
                                {"active_voxels", stats.active_voxels},
                                {"volume_bytes", tree.memoryBytes()},
                                {"prepare_seconds", stats.prepare_seconds},
                                {"march_seconds", stats.march_seconds}};
        tool.say(fmt::format("{} rays, {} shadow rays, {} shaded voxels in {:.2f} s, {} voxels", stats.rays, stats.shadow_rays,
                             stats.shaded_voxels, stats.march_seconds, stats.active_voxels));
        tool.stage("write", [&](const Progress&) {
            std::vector<std::pair<std::string, std::string>> about{{"Software", "volcomp"},
                                                                   {"volcomp/scene", scene_file.string()},
                                                                   {"volcomp/volume", volume_file.string()},
                                                                   {"volcomp/settings", tool.stats["settings"].dump()}};
            for (const auto& output : outputs)
                if (!isExrName(output)) writeImage(output, image, about); // the same bytes whenever it is rendered
            about.emplace_back("volcomp/seconds", fmt::format("{:.2f}", stats.prepare_seconds + stats.march_seconds));
            for (const auto& output : outputs)
                if (isExrName(output)) writeImage(output, image, about);
        });
        if (!preview.empty()) writeImage(preview, image);
        std::filesystem::remove(checkpoint);
        for (const auto& output : outputs) tool.say("wrote " + output.string());
    });
}
