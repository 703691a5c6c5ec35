// SPDX-License-Identifier: Apache-2.0
// All stages of a scene in one go: what is out of date is made again, the rest is left as it is.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tools/shared/tool.h"
#include "volcomp/base/recipe.h"
#include "volcomp/base/words.h"
#include "volcomp/scene/scene.h"

namespace volcomp {

/// The last stage to be done.
enum class Until { bake, place, compose, render };

inline constexpr Word<Until> kUntilWords[] = {{"bake", Until::bake},
                                              {"place", Until::place},
                                              {"compose", Until::compose},
                                              {"render", Until::render}};

/// What is to be made of a scene.
struct DailyOptions {
    std::filesystem::path directory; ///< of the results; empty: out/NAME of the scene's NAME.toml
    Until until = Until::render;
    bool volume = false; ///< a volume file is composed, and rendered
    bool dry_run = false, again = false;
    double max_memory_mb = 0;
    std::string tag; ///< empty, or what stands in the pictures' names; ## means the next number
};

/// The files of a scene's results.
struct DailyFiles {
    std::filesystem::path directory, boxes, volume;
    std::vector<std::filesystem::path> pictures; ///< .exr and .png
    std::filesystem::path recipe;                ///< of the pictures
};

/// DIRECTORY/boxes, DIRECTORY/volume.vdb, DIRECTORY/NAME.exr and .png, with the tag before the
/// ending. In the tag a run of # becomes the number after the last one that is there, or that one
/// itself if `last` is set and there is one. Throws Error if the tag can be no part of a file's
/// name.
DailyFiles dailyFiles(const Scene& scene, const DailyOptions& options, bool last = false);

/// Variants of a box that are to be baked, and why.
struct BoxPlan {
    GrowthRule rule;
    std::vector<int> variants;
    std::string why;
};

/// What is to be done; an empty reason means that it is up to date or not asked for.
struct DailyPlan {
    std::vector<BoxPlan> boxes;
    bool place = false;
    std::string compose, render;
    Recipe picture; ///< of the pictures that the scene makes now
    bool nothing() const { return boxes.empty() && !place && compose.empty() && render.empty(); }
};

/// Compares the files that are there with the scene.
DailyPlan planDaily(const Scene& scene, const DailyFiles& files, const DailyOptions& options);

/// Says what is to be done and why, and does it, unless options.dry_run says not to.
void runDaily(Tool& tool, const Scene& scene, const DailyOptions& options);

} // namespace volcomp
