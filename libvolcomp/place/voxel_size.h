// SPDX-License-Identifier: Apache-2.0
// The finest voxel that a picture can show.
#pragma once

#include <vector>

#include "volcomp/place/placed_scene.h"
#include "volcomp/surface/surface.h"
#include "volcomp/view/camera.h"

namespace volcomp {

/// Returns `pixels` times the edge of a pixel at the nearest point of the surfaces that the camera
/// sees, world units; 0 if it sees none. Looks at 20,000 points spread evenly over each surface and
/// at no more than that many of its corners. Points behind a surface do not count.
double voxelFromCamera(const std::vector<const Surface*>& surfaces, const Camera& camera,
                       int width_pixels, int height_pixels, double pixels);
double voxelFromCamera(const PlacedScene& scene, const Camera& camera, int width_pixels,
                       int height_pixels, double pixels);

} // namespace volcomp
