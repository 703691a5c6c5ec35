// SPDX-License-Identifier: Apache-2.0
// From boxes and placements to one sparse volume (MODEL section 8).
#pragma once

#include <vector>

#include "volcomp/base/progress.h"
#include "volcomp/compose/compose_params.h"
#include "volcomp/place/placed_scene.h"
#include "volcomp/volume/packed_volume.h"
#include "volcomp/volume/volume.h"

namespace volcomp {

/// Adds the placed boxes, and the skins of the surfaces, into one volume of voxels of edge
/// params.voxel (> 0 here).
///
/// Each voxel of a box is treated as a cube aligned with the target's axes, and is distributed over
/// the target's voxels that the cube overlaps. If the target is finer by more than 1.5, the box's
/// voxels are divided first. If it is coarser by 2 or more, eight become one first (coarsen()).
///
/// With Kept::integral this keeps the integral of the density (to the rounding of floats) at any
/// voxel size, and not the mean transmittance; a turn by 90 degrees on an aligned grid is exact.
/// With Kept::blocked_light the densities of each part of a box are multiplied by a factor for
/// which the light that the box blocks stays the same, mean over its axes (blocked_light.h).
///
/// Densities are added, colours and scatter ratios weighted by density. Own shares are kept as the
/// sum over strands of the square of their density. Directions are added as t tᵀ
/// (VolumePart::direction); of two equally strong ones the one placed earlier is kept. Voxels are
/// kept if they are above params.minimum_density and params.minimum_depth. There is one part for
/// each material that a placed box or a skin uses; without any, there is one empty part. The bytes
/// depend neither on the number of threads nor on the machine's instruction set.
///
/// The result is packed, and shares no voxels with the boxes: unpack() makes grids of it,
/// writeVolume() a file. It is in world space, and the centre of voxel (0,0,0) is the origin.
/// OpenVDB must have been started (openvdb::initialize). Throws Error if an index is out of range,
/// a value is not finite, two boxes or skins of one material differ in its kind, a placement's axis
/// is not of unit length or its scale not above 0, or the volume reaches further than 2^24 voxels
/// from the origin.
PackedVolume compose(const std::vector<Box>& boxes, const PlacedScene& scene,
                     const ComposeParams& params, const Progress& progress = {});

/// The same for boxes without surfaces. It copies the placements, so use it for a few.
PackedVolume compose(const std::vector<Box>& boxes, const std::vector<Placement>& placements,
                     const ComposeParams& params, const Progress& progress = {});

/// What compose() would need.
struct ComposeEstimate {
    double voxels = 0; ///< active
    double bytes = 0;  ///< the packed volume and the working memory
};

/// Composes up to 256 tiles of 16^3 voxels for each material and counts. Tiles with more sources
/// are drawn more often and count less, so that a few crowded tiles are not missed. If even finding
/// the tiles would take long, it works at a coarser voxel and multiplies by the cube of the ratio,
/// which gives an upper bound. Throws the Errors of compose().
ComposeEstimate estimateCompose(const std::vector<Box>& boxes, const PlacedScene& scene,
                                const ComposeParams& params);

} // namespace volcomp
