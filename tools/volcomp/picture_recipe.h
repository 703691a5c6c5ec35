// SPDX-License-Identifier: Apache-2.0
// What a picture of a scene is made from, so that it is rendered again only if it would change, and
// what has changed can be said.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "volcomp/base/recipe.h"
#include "volcomp/scene/scene.h"

namespace volcomp {

/// Everything that the scene's picture depends on: the program, what is placed, the voxels, skins,
/// camera, lights, materials, settings and how a PNG shows it. `boxes` are files of boxes that
/// carry no recipe and count by their content. `as_file` says that a volume file lies between.
/// Opens the files that the scene names, to take their hashes.
Recipe pictureRecipe(const Scene& scene, const std::vector<std::filesystem::path>& boxes,
                     bool as_file);

/// Writes the recipe beside the pictures that were made by it, with a hash of each of them. Throws
/// Error if it cannot be written.
void writePictureRecipe(const std::filesystem::path& file, const Recipe& recipe,
                        const std::vector<std::filesystem::path>& pictures);

/// Why the pictures are not what the recipe makes, in one sentence; empty if they are.
std::string whyRender(const std::filesystem::path& file, const Recipe& wanted,
                      const std::vector<std::filesystem::path>& pictures);

} // namespace volcomp
