// SPDX-License-Identifier: Apache-2.0
#include "tools/render/render_stage.h"

#include <algorithm>
#include <atomic>
#include <csignal>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "tools/render/checkpoint.h"
#include "tools/render/light_report.h"
#include "tools/shared/settings.h"
#include "volcomp/base/clock.h"
#include "volcomp/base/error.h"
#include "volcomp/base/hash.h"
#include "volcomp/scene/scene_recipe.h"
#include "volcomp/scene/scene_skins.h"
#include "volcomp/view/image.h"

namespace volcomp {
namespace {

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
Image renderWatched(Tool& tool, const PictureFiles& files, const Scene& scene,
                    const std::vector<VoxelLevel>& levels, const SkinTracer* skins,
                    RenderState state, const nlohmann::json& fingerprint, RenderStats& stats)
{
    const bool saves = files.checkpoint_seconds > 0;
    const fs::path checkpoint = checkpointOf(files);
    double saved = wallSeconds();
    bool preview_warned = false, checkpoint_warned = false, kept = false;
    RenderWatch watch;
    watch.state = std::move(state);
    watch.preview = !files.preview.empty();
    watch.every_seconds = saves ? std::min(10.0, files.checkpoint_seconds) : 10;
    watch.stop = saves ? &stop_asked : nullptr;
    watch.update = [&](const RenderState& so_far, const Image& image) {
        if (!files.preview.empty())
            attempt(tool, "the preview", preview_warned,
                    [&] { writeImage(files.preview, image, {}, scene.look); });
        if (!saves || (!stop_asked && wallSeconds() - saved < files.checkpoint_seconds)) return;
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

void writePictures(const Tool& tool, const PictureFiles& files, const Scene& scene,
                   const std::string& volume, const std::string& recipe,
                   const nlohmann::json& settings, const Look& look, const RenderStats& stats,
                   const Image& image)
{
    std::vector<std::pair<std::string, std::string>> about{{"Software", "volcomp"},
                                                           {"volcomp/scene", scene.file.string()},
                                                           {"volcomp/volume", volume},
                                                           {"volcomp/recipe", recipe},
                                                           {"volcomp/settings", settings.dump()}};
    for (const auto& output : files.outputs)
        if (!requirePictureName(output)) { // the same bytes whenever it is rendered
            auto png = about;
            if (look != Look()) png.emplace_back("volcomp/picture", lookOf(look).dump());
            writeImage(output, image, png, look);
        }
    about.emplace_back("volcomp/seconds",
                       fmt::format("{:.2f}", stats.prepare_seconds + stats.march_seconds));
    for (const auto& output : files.outputs)
        if (requirePictureName(output)) writeImage(output, image, about);
    bool warned = false;
    if (!files.preview.empty())
        attempt(tool, "the preview", warned, [&] { writeImage(files.preview, image, {}, look); });
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

} // namespace

fs::path checkpointOf(const PictureFiles& files)
{
    return files.outputs.empty() ? fs::path() : fs::path(files.outputs[0].string() + ".checkpoint");
}

bool usesCheckpoint(const PictureFiles& files)
{
    return !files.outputs.empty() && (files.resume || files.checkpoint_seconds > 0);
}

RenderState startingState(const Tool& tool, const PictureFiles& files,
                          const nlohmann::json& fingerprint)
{
    const fs::path checkpoint = checkpointOf(files);
    if (files.resume && fs::exists(checkpoint)) {
        tool.say("going on from " + checkpoint.string());
        return readCheckpoint(checkpoint, fingerprint);
    }
    if (files.resume) tool.say("no " + checkpoint.string() + ": starting at the beginning");
    else if (fs::exists(checkpoint))
        tool.warn(
            checkpoint.string()
            + " holds a stopped render, which --resume would go on with; this one starts anew");
    return {};
}

void warnIfDark(const Tool& tool, const Scene& scene)
{
    if (scene.lights.empty() && scene.render.ambient == Vec3d(0.0) && scene.render.dome.black())
        tool.warn(scene.file.string()
                  + ": no [[light]], no [dome] and no ambient light: the volume will be black");
}

std::unique_ptr<const SkinTracer> skinStage(Tool& tool, const Scene& scene)
{
    if (skinRecipe(scene).empty()) return nullptr;
    auto skins = tool.stage("skins", [&](const Progress& p) { return loadSkins(scene, p); });
    tool.stats["skins"] = {{"meshes", skins->meshes().size()}, {"triangles", skins->triangles()}};
    return skins;
}

void renderStage(Tool& tool, const Scene& scene, const RenderedVolume& volume,
                 const SkinTracer* skins, const nlohmann::json& fingerprint, RenderState state,
                 const PictureFiles& files)
{
    RenderStats stats;
    const Image image = renderWatched(tool, files, scene, volume.levels, skins, std::move(state),
                                      fingerprint, stats);
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
    if (!volume.made.composite)
        ingredients["volume"] =
            volume.recipe.empty() ? fingerprint["volume"]["file"].dump() : volume.recipe;
    const std::string recipe = fmt::format("{:016x}", fnv1a(ingredients.dump()));
    tool.stats["recipe"] = recipe;
    tool.stage("write", [&](const Progress&) {
        writePictures(tool, files, scene, volume.name, recipe, tool.stats["settings"], scene.look,
                      stats, image);
    });
    std::error_code ignored;
    if (usesCheckpoint(files)) fs::remove(checkpointOf(files), ignored);
    for (const auto& output : files.outputs) tool.say("wrote " + output.string());
    for (const std::string& line : lightReport(scene.lights, stats)) tool.say(line);
}

} // namespace volcomp
