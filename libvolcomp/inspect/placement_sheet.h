// SPDX-License-Identifier: Apache-2.0
// A sheet of pictures of the second densities: where boxes stand, and each map on its surface.
#pragma once

#include "volcomp/view/camera.h"
#include "volcomp/view/image.h"
#include "volcomp/place/placed_scene.h"

namespace volcomp {

/// Draws panels of width x height pixels, as the camera sees the surfaces. The first shows them
/// with a dot for each placement, in the colour of its layer (red, green, blue, yellow, magenta and
/// cyan in turn). Then follow, for each layer, its second density in grey and its colour map if it
/// has one. Labels name the layers with their numbers of boxes, and the maps. Throws Error if the
/// font DejaVu Sans is not installed.
Image placementSheet(const PlacedScene& scene, const Camera& camera, int width, int height);

} // namespace volcomp
