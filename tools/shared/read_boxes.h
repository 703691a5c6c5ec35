// SPDX-License-Identifier: Apache-2.0
// The box files of a scene in the folder that volcomp-bake wrote.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "tools/shared/stale.h"
#include "tools/shared/tool.h"
#include "volcomp/base/distinct_files.h"
#include "volcomp/base/progress.h"
#include "volcomp/base/recipe.h"
#include "volcomp/scene/scene.h"
#include "volcomp/scene/scene_recipe.h"
#include "volcomp/volume/volume.h"

namespace volcomp {

/// The file of one variant, counted from 0, of a box.
std::filesystem::path boxFile(const std::filesystem::path& directory, const std::string& box,
                              int variant);

/// The same for a box of the scene, which may name files of its own.
std::filesystem::path boxFile(const Scene& scene, const std::filesystem::path& directory,
                              const std::string& box, int variant);

/// The files of all boxes that the scene's layers use, each as "a box". They need not exist.
std::vector<NamedFile> boxFiles(const Scene& scene, const std::filesystem::path& directory);

/// The boxes that a scene's layers use.
struct ReadBoxes {
    std::vector<Box> boxes;    ///< in the order of usedBoxes()
    std::vector<UsedBox> used; ///< by kind: what they were baked from
};

/// Reads them, and prints the warnings of their files. Throws Error if one is not there, cannot be
/// read, or if the scene would bake it otherwise, unless `stale` allows that.
ReadBoxes readBoxes(const Tool& tool, const Scene& scene, const std::filesystem::path& directory,
                    Stale stale, const Progress& progress = {});

/// The same, but hands each box to `take` as it is read, in that order, so that there need not be
/// more than one at a time.
std::vector<UsedBox> readBoxes(const Tool& tool, const Scene& scene,
                               const std::filesystem::path& directory, Stale stale,
                               const std::function<void(Box&&)>& take,
                               const Progress& progress = {});

/// What a volume of these boxes is made from: the scene's placements, without the surfaces that the
/// user left out.
Recipe volumeRecipe(const Scene& scene, const std::vector<UsedBox>& used,
                    const std::vector<std::string>& leave_out);

} // namespace volcomp
