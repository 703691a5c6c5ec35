// SPDX-License-Identifier: Apache-2.0
// The stage *bake* of the programs: variants of a box become files.
#pragma once

#include <filesystem>
#include <vector>

#include "tools/shared/tool.h"
#include "volcomp/grow/growth_rule.h"
#include "volcomp/inspect/box_sheet.h"
#include "volcomp/scene/scene.h"
#include "volcomp/volume/vdb_io.h"

namespace volcomp {

/// Where boxes are written, and how.
struct BakeToFiles {
    std::filesystem::path directory; ///< it is there
    GridNames grid_names = GridNames::houdini;
    std::vector<BoxThumbnail>* thumbnails = nullptr; ///< gets a picture of each box; null: none
};

/// The numbers of all variants of a box, from 0.
std::vector<int> allVariants(const GrowthRule& rule);

/// Bakes these variants of a box, each to its boxFile() with its recipe, says what they hold and
/// adds it to the statistics. A box that has files of its own is not baked. Throws Error as bake()
/// and writeVolume() do.
void bakeStage(Tool& tool, const Scene& scene, const GrowthRule& rule,
               const std::vector<int>& variants, const BakeToFiles& to);

} // namespace volcomp
