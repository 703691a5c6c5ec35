// From boxes and placements to one sparse volume (MODEL section 8).
#pragma once

#include <vector>

#include "volcomp/compose/compose_params.h"
#include "volcomp/volume/packed_volume.h"
#include "volcomp/base/progress.h"
#include "volcomp/place/placed_scene.h"
#include "volcomp/volume/volume.h"

namespace volcomp {

/// Adds the placed boxes, and the skins of the surfaces, into one volume of voxels of edge
/// params.voxel (> 0 here).
///
/// Every voxel of a box is spread over the target's voxels that a cube of its size, with the
/// target's axes, overlaps: the integral of density is kept exactly (to float rounding) at any
/// voxel size, nothing thin is lost, and a turn by 90 degrees on an aligned grid is exact. Where
/// the target is finer by more than 1.5, voxels are divided first; where it is coarser by 2 or
/// more, the box's voxels are summed by eights first (coarsen()). Coarser voxels therefore keep the
/// integral, not the mean transmittance; a volume that is to be seen from far away is composed fine
/// and coarsened by the renderer's level of detail. Densities sum, colours weighted by density;
/// directions as t tᵀ (VolumePart::direction), where the earlier of two equally strong ones is
/// kept. Voxels not above params.minimum_density are not kept. There is one part for each material
/// that a placed box or skin uses; without any, one empty part. The bytes do not depend on threads.
/// The result is packed: unpack() makes grids of it, writeVolume() a file. Throws Error for indices
/// out of range, values that are not finite, and volumes beyond 2^24 voxels from the origin.
PackedVolume compose(const std::vector<Box>& boxes, const PlacedScene& scene,
                     const ComposeParams& params, const Progress& progress = {});

/// The same for boxes without surfaces, of which it makes a copy: for a few of them.
PackedVolume compose(const std::vector<Box>& boxes, const std::vector<Placement>& placements,
                     const ComposeParams& params, const Progress& progress = {});

/// What compose() would need.
struct ComposeEstimate {
    double voxels = 0; ///< active
    double bytes = 0;  ///< the packed volume and the working memory
};

/// Composes up to 256 tiles of 16^3 voxels for each material and counts. A tile is drawn the more
/// often the more sources it has, and counts the less, so that few crowded tiles do not escape.
/// Where even finding the tiles would take long, it works at a coarser voxel and multiplies by the
/// cube of the ratio, which is an upper bound.
ComposeEstimate estimateCompose(const std::vector<Box>& boxes, const PlacedScene& scene,
                                const ComposeParams& params);

} // namespace volcomp
