// SPDX-License-Identifier: Apache-2.0
// Coarser voxels of a box, and which of its voxels hold the same strand.
#pragma once

#include <cstdint>

#include "volcomp/compose/box_source.h"
#include "volcomp/compose/compose_params.h"

namespace volcomp {

/// Returns the part with voxels of twice the edge, each at the centre of mass of what it holds, for
/// targets so coarse that the finer voxels of a place would all fall into one. Directions and
/// colours are summed; the directions of up to eight voxels become one with its spread.
///
/// Kept::integral sums the densities. Kept::blocked_light keeps the mean transmittance of the eight
/// under directed extinction, mean over the axes, and the light that they scatter
/// (coarser_voxel.h), at an optical depth of 1 for density 1 over length 1.
SourcePart coarsen(const SourcePart& part, Kept keep);

/// In how many dimensions the strands of a part go on from voxel to voxel: 0 for specks, 1 for
/// hairs, 2 for wide leaves.
double dimensionOf(const SourcePart& part);

// What packPart() makes a part with, too:

/// Sets v and iso from a stored direction, whose length is 1 - spread. Without a direction (length
/// 0) the sum is the same in all directions. v.density() must be set.
void setDirection(SourceVoxel& v, const Vec3f& d);

/// See append().
void reserve(SourcePart& part, std::size_t count);
void append(SourcePart& part, const Vec3f& place, const SourceVoxel& v);

/// The bits of the coordinates in turn (Morton, A computer oriented geodetic data base, 1966).
/// Voxels that are sorted by this key have their neighbours close in the list. For coordinates from
/// -2^20 to 2^20 - 1.
std::uint64_t mortonKey(std::int32_t x, std::int32_t y, std::int32_t z);

/// Finds the bounds of runs, of groups and of all, pads the lists, and lets go of memory that they
/// do not fill. To be called when all voxels are in `s`.
void setBounds(SourcePart& s);

} // namespace volcomp
