// SPDX-License-Identifier: Apache-2.0
// How much of each voxel lies inside of bodies. Private to baking.
#pragma once

#include <array>
#include <vector>

#include <openvdb/openvdb.h>

#include "volcomp/base/vec.h"

namespace volcomp {

/// Returns the part of each voxel that is inside, 0 to 1; nothing outside. Triangles are in cells:
/// voxel (i,j,k) is [i, i+1)^3. Inside is where they wind around, either way; so bodies may
/// overlap, and closed ones have exactly their volume along x, by 4 x 4 lines for each voxel
/// across. Triangles that share an edge must have the same numbers at its ends. Throws Error for
/// more than about 1e9 crossings or 1e8
/// voxels inside.
openvdb::FloatGrid::Ptr fillSolids(const std::vector<std::array<Vec3d, 3>>& triangles);

} // namespace volcomp
