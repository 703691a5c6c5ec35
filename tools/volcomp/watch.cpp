// SPDX-License-Identifier: Apache-2.0
#include "tools/volcomp/watch.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <sys/stat.h>

#include "tools/bake/bake_stage.h"
#include "tools/compose/compose_stage.h"
#include "tools/render/render_stage.h"
#include "tools/shared/rendered_volume.h"
#include "volcomp/base/clock.h"
#include "volcomp/render/render.h"
#include "volcomp/render/tree/voxel_levels.h"
#include "volcomp/scene/scene_dome.h"
#include "volcomp/scene/scene_recipe.h"
#include "volcomp/view/image.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;

std::atomic<bool> end_asked{false};

/// Lets SIGINT and SIGTERM ask for the end during its lifetime; a second one ends the program.
class EndOnSignal {
public:
    EndOnSignal()
    {
        end_asked = false;
        struct sigaction action { };
        action.sa_handler = [](int) { end_asked = true; };
        action.sa_flags = SA_RESETHAND;
        for (const int signal : {SIGTERM, SIGINT}) sigaction(signal, &action, nullptr);
    }
    ~EndOnSignal()
    {
        for (const int signal : {SIGTERM, SIGINT}) std::signal(signal, SIG_DFL);
    }
};

/// What tells a saved file from the one before; all zeros if there is none.
struct Stamp {
    std::int64_t seconds = 0, nanoseconds = 0, size = 0;
    std::uint64_t number = 0;
    bool operator==(const Stamp& o) const
    {
        return seconds == o.seconds && nanoseconds == o.nanoseconds && size == o.size
            && number == o.number;
    }
};

Stamp stampOf(const fs::path& file)
{
    struct stat s { };
    if (::stat(file.c_str(), &s) != 0) return {};
    return {s.st_mtim.tv_sec, s.st_mtim.tv_nsec, s.st_size, s.st_ino};
}

/// The files of a scene, as they were when they were looked at.
class WatchedFiles {
public:
    explicit WatchedFiles(std::vector<fs::path> files) : m_files(std::move(files))
    {
        m_stamps.reserve(m_files.size());
        for (const fs::path& file : m_files) m_stamps.push_back(stampOf(file));
    }
    const std::vector<fs::path>& files() const { return m_files; }
    /// The first file that is another one now; empty if there is none.
    fs::path changed() const
    {
        for (std::size_t i = 0; i < m_files.size(); ++i)
            if (!(stampOf(m_files[i]) == m_stamps[i])) return m_files[i];
        return {};
    }

private:
    std::vector<fs::path> m_files;
    std::vector<Stamp> m_stamps;
};

constexpr std::chrono::milliseconds kPause{30}; // between looks at the files

/// During its lifetime, sets `stop` as soon as a file changes or the end is asked for.
class StopOnChange {
public:
    explicit StopOnChange(const WatchedFiles& files)
        : m_thread([this, &files] {
              while (!m_done) {
                  if (end_asked || !files.changed().empty()) stop = true;
                  std::this_thread::sleep_for(kPause);
              }
          })
    {
    }
    ~StopOnChange()
    {
        m_done = true;
        m_thread.join();
    }
    std::atomic<bool> stop{false};

private:
    std::atomic<bool> m_done{false};
    std::thread m_thread;
};

/// What stays from one preview to the next, with the recipes that say for how long.
struct KeptWork {
    std::string volume_recipe, skin_recipe;
    std::optional<RenderedVolume> volume;
    std::unique_ptr<const SkinTracer> skins;
};

/// Everything that placed boxes and their voxels depend on.
std::string volumeRecipeOf(const Scene& scene)
{
    return placedRecipe(scene, wantedBoxes(scene)).text() + composeRecipe(scene, false).text();
}

/// Bakes, reads and places what the scene has otherwise than what is kept.
void prepare(Tool& tool, const Scene& scene, const DailyFiles& files, const DailyOptions& options,
             KeptWork& kept)
{
    DailyOptions bake = options;
    bake.until = Until::bake;
    const DailyPlan plan = planDaily(scene, files, bake);
    const std::string recipe = volumeRecipeOf(scene);
    const bool same = plan.boxes.empty() && kept.volume && recipe == kept.volume_recipe;
    if (!same || !servesCamera(*kept.volume, scene)) {
        kept.volume.reset(); // before the next one takes its memory
        for (const BoxPlan& box : plan.boxes) {
            tool.say(fmt::format("bake {}: {}", box.rule.name, box.why));
            bakeStage(tool, scene, box.rule, box.variants,
                      {files.boxes, GridNames::houdini, nullptr});
        }
        kept.volume =
            volumeOfBoxes(tool, scene, {files.boxes, Stale::refused, options.max_memory_mb, {}});
        kept.volume_recipe = recipe;
    }
    if (const std::string skins = skinRecipe(scene).text();
        !kept.skins || skins != kept.skin_recipe) {
        kept.skins = skinStage(tool, scene);
        kept.skin_recipe = skins;
    }
}

/// Renders the preview until it is complete or `stop` is set.
void renderPreview(const Tool& tool, const Scene& scene, const KeptWork& kept,
                   const fs::path& preview, const std::atomic<bool>& stop, double start)
{
    bool first = true;
    RenderWatch watch;
    watch.preview = true;
    watch.stop = &stop;
    watch.update = [&](const RenderState&, const Image& image) {
        if (stop) return;
        writeImage(preview, image, {}, scene.look);
        if (first) tool.say(fmt::format("first preview after {:.1f} s", wallSeconds() - start));
        first = false;
    };
    const Image image = render(
        tileLevels(kept.volume->trees, scene.camera, scene.render, scene.compose.voxel_pixels),
        scene.materials, scene.camera, scene.lights, scene.render, {}, nullptr, &watch,
        kept.skins.get());
    writeImage(preview, image, {}, scene.look);
    tool.say(fmt::format("{} is complete after {:.1f} s", preview.string(), wallSeconds() - start));
}

/// Makes the preview of the scene as it is now. Returns the files that count for the next one, as
/// they were when it was read; `before` if it cannot be read.
WatchedFiles makePreview(Tool& tool, const fs::path& file, const std::function<Scene()>& read,
                         const DailyOptions& options, const WatchedFiles& before, KeptWork& kept)
{
    const double start = wallSeconds();
    WatchedFiles watched = before;
    try {
        Scene scene = read();
        watched = WatchedFiles(usedFiles(scene));
        const StopOnChange changed(watched);
        const DailyFiles files = dailyFiles(scene, options);
        fs::create_directories(files.boxes);
        prepare(tool, scene, files, options, kept);
        for (const std::string& sun : loadSceneDome(scene)) tool.say(sun);
        renderPreview(tool, scene, kept, files.directory / (file.stem().string() + ".preview.png"),
                      changed.stop, start);
    } catch (const Stopped&) { // something was saved meanwhile
    } catch (const std::exception& e) {
        tool.warn(e.what());
    }
    return watched;
}

} // namespace

void watchScene(Tool& tool, const fs::path& file, const std::function<Scene()>& read,
                const DailyOptions& options)
{
    const EndOnSignal handler;
    KeptWork kept;
    tool.say("watching the scene, its maps and its meshes; Ctrl-C ends");
    WatchedFiles watched({file});
    while (!end_asked) {
        const WatchedFiles before(watched.files()); // as they are now, before the scene is read
        watched = makePreview(tool, file, read, options, before, kept);
        fs::path saved;
        while (saved.empty() && !end_asked) {
            saved = before.changed();
            if (saved.empty()) saved = watched.changed();
            if (saved.empty()) std::this_thread::sleep_for(kPause);
        }
        if (!saved.empty()) tool.say(saved.string() + " was saved");
    }
}

} // namespace volcomp
