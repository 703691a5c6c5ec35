// SPDX-License-Identifier: Apache-2.0
// The stage *place* for a scene file: what place/ needs, taken from the Scene.
#pragma once

#include <vector>

#include "volcomp/base/progress.h"
#include "volcomp/place/placed_scene.h"
#include "volcomp/scene/scene.h"
#include "volcomp/volume/volume.h"

namespace volcomp {

/// The kinds of box that the scene's layers use, and all grooms, whose pieces are variants, in the
/// order of scene.boxes. compose() takes the variants of the first kind, then those of the second,
/// and so on.
std::vector<BoxKind> usedBoxes(const Scene& scene);

/// Loads the scene's surfaces and scatters its layers over them; `kinds` of the result are
/// usedBoxes(). Each groom is a layer without a surface behind the others, and each of its pieces
/// stands once. Throws Error as the place() of place/placed_scene.h and CurvePieces do.
PlacedScene place(const Scene& scene, const PlaceOptions& options = {},
                  const Progress& progress = {});

/// Where a voxel size comes from.
enum class VoxelSource {
    scene,  ///< compose.voxel
    camera, ///< compose.voxel_pixels at the nearest point of a surface that the camera sees
    boxes   ///< the voxel of the finest box, before its scale, as the camera sees no surface
};

/// An edge of a voxel, world units, and where it comes from.
struct ChosenVoxel {
    double size;
    VoxelSource source;
};

/// The voxel to compose the scene with. Throws Error if the scene gives none, the camera sees no
/// surface and there are no boxes.
ChosenVoxel chooseVoxel(const Scene& scene, const PlacedScene& placed,
                        const std::vector<Box>& boxes);

} // namespace volcomp
