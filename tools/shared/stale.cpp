// SPDX-License-Identifier: Apache-2.0
#include "tools/shared/stale.h"

#include "volcomp/base/error.h"
#include "volcomp/scene/scene_recipe.h"

namespace volcomp {

void addAllowStale(CLI::App& app, Stale& stale)
{
    app.add_flag_callback(
        "--allow-stale", [&stale] { stale = Stale::allowed; },
        "Take files that the scene would make otherwise now, and only warn");
}

void requireFresh(const Tool& tool, const std::filesystem::path& file, const Recipe& made,
                  const Recipe& wanted, Stale stale, const std::string& advice)
{
    if (made.empty()) return;
    Recipe by_scene;
    for (const auto& [name, value] : made.entries())
        if (name.rfind(kOption, 0) != 0) by_scene.add(name, value);
    const std::string difference = differenceText(differences(by_scene, wanted));
    if (difference.empty()) return;
    if (stale == Stale::refused)
        throw fileError(file, "", "a file that this scene makes",
                        "one of another scene: " + difference,
                        advice + ", or take it as it is with --allow-stale.");
    tool.warn(file.string() + ": the scene would make it otherwise now: " + difference);
}

} // namespace volcomp
