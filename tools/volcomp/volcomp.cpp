// SPDX-License-Identifier: Apache-2.0
// volcomp: from a scene to its picture in one command, which does only what is out of date.
#include <string>

#include "tools/render/render_options.h"
#include "tools/shared/choice.h"
#include "tools/shared/numbers.h"
#include "tools/shared/scene_option.h"
#include "tools/shared/tool.h"
#include "tools/volcomp/compare.h"
#include "tools/volcomp/daily.h"
#include "tools/volcomp/layout_stage.h"
#include "tools/volcomp/schema.h"
#include "tools/volcomp/watch.h"
#include "volcomp/scene/scene.h"

namespace {

using namespace volcomp;

struct Options {
    DailyOptions daily;
    bool layout = false, watch = false;
    std::string camera; ///< or empty
};

void addOptions(CLI::App& app, Options& all)
{
    DailyOptions& options = all.daily;
    app.add_flag(
        "--layout", all.layout,
        "Draw the scene's layout in seconds and do nothing else: surfaces with their maps, "
        "roots and lean of the boxes, lights, the picture's frame (DIR/NAME.layout.png)");
    app.add_flag(
        "--watch", all.watch,
        "Render a preview (DIR/NAME.preview.png), and again whenever the scene, one of its "
        "maps or a mesh is saved; Ctrl-C ends");
    app.add_option("--camera", all.camera,
                   "Another camera to try on: eye x,y,z, target x,y,z and at most a field of view "
                   "in degrees")
        ->type_name("EYE,TARGET[,FOV]");

    app.add_option("-o,--output", options.directory,
                   "Folder of the results (default: out/NAME, where the scene is NAME.toml)")
        ->type_name("DIR");
    addChoice(app, "--until", options.until,
              "Last stage to do (default: render); compose writes a volume file", kUntilWords);
    app.add_flag("--volume", options.volume,
                 "Compose a volume file and render it, instead of making voxels where rays look");
    app.add_flag("-n,--dry-run", options.dry_run, "Only say what would be done, and why");
    app.add_flag("--again", options.again, "Do everything again, also what is up to date");
    app.add_option(
           "--tag", options.tag,
           "Write NAME.TAG.exr and .png beside other pictures; in it ## stands for the next "
           "number, as in v##")
        ->type_name("TAG");
    app.add_option("--max-memory", options.max_memory_mb,
                   "Memory of the whole program, in MB; 0: half of the machine's, or 3/4 to "
                   "compose a file")
        ->capture_default_str()
        ->check(realNumber(0));
}

} // namespace

int main(int argc, char** argv)
{
    if (argc > 1 && std::string(argv[1]) == "compare") return compareMain(argc - 1, argv + 1);
    Tool tool("volcomp",
              "Bakes, places and renders a scene, of which it does only what is out of date. "
              "volcomp compare A B compares two pictures.");
    tool.addPrint("--schema", "Print the JSON Schema of the scene file, for editors, and exit",
                  [] { return keysAsSchema(sceneKeys()); });
    Options options;
    const SceneOption file(tool.app);
    addOptions(tool.app, options);
    const RenderOptions overrides(tool.app);
    return tool.main(argc, argv, [&] {
        DailyOptions& daily = options.daily;
        const auto read = [&] {
            Scene scene = file.read(tool);
            overrides.apply(scene.render);
            overrides.apply(scene.look);
            if (!options.camera.empty()) scene.camera = readCamera(options.camera, scene.camera);
            return scene;
        };
        if (options.watch) return watchScene(tool, file.file(), read, daily);
        const Scene scene = read();
        daily.volume = daily.volume || daily.until == Until::compose;
        if (options.layout) layoutStage(tool, scene, dailyFiles(scene, daily).directory);
        else runDaily(tool, scene, daily);
    });
}
