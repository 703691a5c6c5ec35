// SPDX-License-Identifier: Apache-2.0
// `volcomp --watch`: a preview that is rendered again whenever a file of the scene is saved.
#pragma once

#include <filesystem>
#include <functional>

#include "tools/shared/tool.h"
#include "tools/volcomp/daily.h"
#include "volcomp/scene/scene.h"

namespace volcomp {

/// Reads the scene by `read`, bakes what is out of date, and renders DIRECTORY/NAME.preview.png:
/// coarsely first, then better and better. When the scene, a file that it includes, a mesh or an
/// image is saved it begins again, with boxes, placements, tiles and skins kept as far as they stay
/// the same. What is wrong with a scene is printed, and the next save waited for. Ends with SIGINT
/// or SIGTERM. `file` is the scene's.
void watchScene(Tool& tool, const std::filesystem::path& file, const std::function<Scene()>& read,
                const DailyOptions& options);

} // namespace volcomp
