// SPDX-License-Identifier: Apache-2.0
// The stage *compose* for one camera: a volume file for each level of voxels that it looks at.
#pragma once

#include <filesystem>

#include "tools/shared/stale.h"
#include "tools/shared/tool.h"
#include "volcomp/scene/scene.h"
#include "volcomp/volume/vdb_io.h"

namespace volcomp {

/// Where the volumes are written, and how.
struct ViewToFiles {
    std::filesystem::path output, boxes;
    Stale stale = Stale::refused;
    GridNames grid_names = GridNames::houdini;
    double max_memory_mb = 0; ///< of the whole process; 0: half of the machine's
};

/// VOLUME.level0.vdb and on for VOLUME.vdb.
std::filesystem::path levelFile(const std::filesystem::path& volume, int level);

/// Reads and places the boxes and writes the voxels that viewVolume() takes of each level for the
/// scene's camera; a level of which it takes none has no file. Says what it writes and adds it to
/// the statistics. Throws the Errors of volumeOfBoxes() and writeVolume(), and one if the tiles of
/// a level do not fit into the memory.
void viewStage(Tool& tool, const Scene& scene, const ViewToFiles& to);

} // namespace volcomp
