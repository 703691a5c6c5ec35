// SPDX-License-Identifier: Apache-2.0
// A scene whose volume is made where it is looked at, from a scene file and box files.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tools/shared/read_boxes.h"
#include "tools/shared/stale.h"
#include "tools/shared/tool.h"
#include "volcomp/base/recipe.h"
#include "volcomp/compose/virtual_composite.h"
#include "volcomp/place/culling.h"
#include "volcomp/place/placed_scene.h"
#include "volcomp/scene/scene.h"

namespace volcomp {

/// The voxels of a virtual composite's levels.
struct VoxelRange {
    double finest; ///< edge, world units
    int levels;
};

/// What a program needs to make the volume of a scene tile by tile. It may be moved.
struct VirtualScene {
    std::unique_ptr<const PlacedScene> placed; ///< that the composite refers to
    std::unique_ptr<VirtualComposite> composite;
    Recipe recipe; ///< what the volume is made from, without a voxel
};

/// How large a box is, in its own space.
struct BoxSize {
    BoxBall ball;
    double voxel; ///< edge
};

/// How a program comes by one.
struct VirtualSceneOptions {
    std::filesystem::path boxes; ///< folder of the box files
    Stale stale = Stale::refused;
    std::vector<std::string> leave_out; ///< of the recipe alone: see leaveOut()
    /// Chooses the voxels when the boxes have been read and placed.
    std::function<VoxelRange(const PlacedScene&, const std::vector<BoxSize>&)> voxels;
};

/// Reads the boxes, places them, and packs them for all levels, as stages of the program. Throws
/// the Errors of readBoxes(), place() and VirtualComposite.
VirtualScene virtualScene(Tool& tool, const Scene& scene, const VirtualSceneOptions& options);

} // namespace volcomp
