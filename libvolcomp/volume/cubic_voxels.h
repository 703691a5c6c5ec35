// SPDX-License-Identifier: Apache-2.0
// Voxels of any affine transform as cubes along the axes of the world.
#pragma once

#include "volcomp/volume/volume.h"

namespace volcomp {

/// True if the voxels of a linear transform are cubes along the axes, none of them mirrored.
bool hasCubicVoxels(const openvdb::math::Transform& transform);

/// The volume in cubic voxels along the axes of the world, whose edge is the shortest edge of the
/// volume's own voxels (which all parts have in common). A density is the trilinear interpolation
/// of the eight nearest voxels; so is a colour, weighted by density; a direction is that of the
/// voxel that adds the most. Constant densities stay exactly, and the integral as well as sampling
/// keeps it (a few per cent of the finest detail). Throws Error if the result would have more than
/// 2^31 voxels. Directions are in world space and are not turned.
Volume withCubicVoxels(const Volume& volume);

} // namespace volcomp
