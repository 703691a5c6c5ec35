// SPDX-License-Identifier: Apache-2.0
// Placements in files that other programs read.
#pragma once

#include <filesystem>
#include <string>

#include "volcomp/place/placed_scene.h"

namespace volcomp {

/// Throws Error if the name ends in none of .json, .ply and .usda; returns true for .json.
bool requirePlacementsName(const std::filesystem::path& file);

/// Writes where the boxes stand. FILE.json is an array of objects with the keys box and layer
/// (their names), position, scale, x_axis, y_axis, z_axis, tint and, if the scene keeps it
/// (PlaceOptions::keep_uvs), uv. FILE.ply is binary and holds for each box x y z, nx ny nz (its y
/// axis), red green blue (its tint, clamped to 1), its scale, and box and layer as numbers, which
/// comments in the header name (control characters as \x0A and so on). FILE.usda is a USD point
/// instancer: its prototypes are volumes that name the files NAME_VARIANT.vdb beside it; positions
/// are floats, and tints are the primvar displayColor. The ending may be in any
/// case of letters. Lengths are world units. The file appears under its name when it is
/// complete. A PLY file also says the hash of the recipe (base/recipe.h), if one is given, in a
/// comment. Throws Error for another ending and for a file that cannot be written.
void writePlacements(const std::filesystem::path& file, const PlacedScene& scene,
                     const std::string& recipe_hash = {});

} // namespace volcomp
