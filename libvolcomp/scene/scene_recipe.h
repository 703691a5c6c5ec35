// SPDX-License-Identifier: Apache-2.0
// The recipes (base/recipe.h) of what the programs make of a scene: the keys that count, with
// their defaults, the content of the files that they name, and the version of the stage.
//
// A box file and a composed volume keep theirs as the metadata kRecipe; pictures and lists of
// placements keep its hash.
#pragma once

#include <string>
#include <vector>

#include <openvdb/Metadata.h>
#include <openvdb/openvdb.h>

#include "volcomp/base/recipe.h"
#include "volcomp/scene/scene.h"

namespace volcomp {

/// Name of a VDB file's metadata that holds the text of its recipe.
constexpr const char* kRecipe = "volcomp_recipe";

/// The beginning of the names of entries that say what the user has asked for beside the scene,
/// such as a voxel on the command line. A file that differs from the scene in these is not stale.
constexpr const char* kOption = "option ";

/// What every variant of a box is baked from, but not how many there are. Materials count by their
/// kinds alone: the rest of them is the renderer's.
Recipe boxRecipe(const Scene& scene, const GrowthRule& rule);

/// A box that compose() takes, by its name, and the hash of the recipe in its file, or
/// Recipe::kUnknown for a file that another program made.
struct UsedBox {
    std::string name, hash;
};

/// What a scene's volume is made of: the surfaces on which boxes stand, the skins that are voxels,
/// the layers, and the boxes that they use. The voxel, the camera and skins that are meshes are not
/// in it.
Recipe placedRecipe(const Scene& scene, const std::vector<UsedBox>& boxes);

/// What the skins that are meshes are made of, which the renderer traces; empty if there are none.
/// Materials are not in it.
Recipe skinRecipe(const Scene& scene);

/// The boxes that the scene's layers use, as volcomp-bake would make them.
std::vector<UsedBox> wantedBoxes(const Scene& scene);

/// The recipe in a file's metadata; empty if it has none.
Recipe recipeOf(const openvdb::MetaMap& metadata);

/// One sentence about the first differences, at most three: what the file was made from, and what
/// the scene says. Empty if there are none.
std::string differenceText(const std::vector<RecipeDifference>& differences);

} // namespace volcomp
