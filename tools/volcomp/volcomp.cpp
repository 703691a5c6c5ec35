// SPDX-License-Identifier: Apache-2.0
// volcomp: from a scene to its picture in one command, which does only what is out of date.
#include <filesystem>

#include "tools/render/render_options.h"
#include "tools/shared/choice.h"
#include "tools/shared/numbers.h"
#include "tools/shared/tool.h"
#include "tools/volcomp/daily.h"
#include "volcomp/scene/scene.h"

namespace {

using namespace volcomp;

void addOptions(CLI::App& app, std::filesystem::path& scene, DailyOptions& options)
{
    app.add_option("scene", scene, "Scene file (TOML)")->required()->type_name("SCENE");
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
    Tool tool("volcomp",
              "Bakes, places and renders a scene, of which it does only what is out of date.");
    std::filesystem::path file;
    DailyOptions options;
    addOptions(tool.app, file, options);
    const RenderOptions overrides(tool.app);
    return tool.main(argc, argv, [&] {
        Scene scene = readScene(file);
        for (const std::string& warning : scene.warnings) tool.warn(warning);
        overrides.apply(scene.render);
        overrides.apply(scene.look);
        options.volume = options.volume || options.until == Until::compose;
        runDaily(tool, scene, options);
    });
}
