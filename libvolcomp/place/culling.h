// SPDX-License-Identifier: Apache-2.0
// Which placed boxes matter to a picture.
#pragma once

#include <vector>

#include "volcomp/place/placement.h"
#include "volcomp/view/camera.h"
#include "volcomp/view/light.h"
#include "volcomp/volume/volume.h"

namespace volcomp {

/// Returns false if a ball is surely out of the picture, or entirely behind the eye. It is a
/// conservative test against the picture's four sides and the plane of the eye: near the picture's
/// corners it returns true for some balls that are out of it.
bool mayBeInView(const Camera& camera, int width_pixels, int height_pixels, const Vec3d& centre,
                 double radius);

/// The ball around all voxels of a box, in the box's own space.
struct BoxBall {
    Vec3d centre{0.0};
    double radius = -1; ///< -1: the box has no voxels
};
BoxBall ballOf(const Box& box);

/// Distances from the eye, world units, of what may be in view.
struct ViewedRange {
    double nearest = 0, farthest = 0; ///< both 0 if nothing is
};
/// Of the balls around the placed boxes that may be in view (mayBeInView()); `balls` are those of
/// the boxes that Placement::box names. Boxes without voxels do not count.
ViewedRange viewedRange(const PlacementList& list, const std::vector<BoxBall>& balls,
                        const Camera& camera, int width_pixels, int height_pixels);

/// Drops the placements whose boxes are neither in the picture nor able to throw a shadow on a box
/// that is in it; the order of the others is kept. Boxes without voxels are dropped. `boxes` are
/// those that Placement::box names. Returns how many were dropped.
std::size_t cullPlacements(PlacementList& list, const std::vector<Box>& boxes, const Camera& camera,
                           int width_pixels, int height_pixels, const std::vector<Light>& lights);

} // namespace volcomp
