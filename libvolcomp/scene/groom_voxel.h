// SPDX-License-Identifier: Apache-2.0
// The voxel that a picture of a groom needs.
#pragma once

#include "volcomp/curves/curve_pieces.h"
#include "volcomp/scene/scene.h"

namespace volcomp {

/// Returns the edge of the voxels to bake a groom with, world units: the scene's compose.voxel if
/// it has one; otherwise compose.voxel_pixels pixels at the nearest point of a strand that may be
/// in view, but at least the width of the strands (the median of the points): strands that are
/// thicker than their voxels shade themselves (docs/grooms.md). Returns 0 if nothing is in view.
double groomVoxel(const Scene& scene, const CurvePieces& groom);

} // namespace volcomp
