// Strands and leaves to voxels, by coverage (MODEL section 2).
//
// Each strand covers the part c of a voxel's cross-section and adds the density -ln(1 - c) / h, c at most 0.99:
//   thin round strands (radius < h/2)   c = (pi/4) 2 r l / h^2, l the exact length in the voxel: direction averaged, and exactly
//                                       conserved; from a quarter voxel of width on it is spread over the cross-section
//   thick round strands                 c = the part of the voxel that is filled, so that their inside is full too
//   flat shapes                         c = area / (2 h^2) where they are narrower than a voxel (direction averaged), rising to
//                                       area / h^2 where they are two voxels wide: a wide leaf is opaque from everywhere
// The two formulas for round strands agree at r = h/2. Pieces of one strand in one voxel are summed (thin, flat) or joined (thick)
// before the logarithm: neither joints nor the number of pieces count.
#pragma once

#include <vector>

#include "grow.h"
#include "material.h"
#include "progress.h"
#include "volume.h"

namespace volcomp {

/// One part of a volume: density, direction and colour of `segments` in voxels of edge `voxel` (metres), material and kind as given.
/// The direction is the density-weighted principal tangent (fibre) or normal (surface). The colour grid is null where all
/// segments have one colour. The grids are as large as the segments need. The bytes do not depend on the number of threads.
/// Throws Error where the voxels would not fit into OpenVDB's index space (coordinates beyond 2^20) or a segment is not finite.
VolumePart rasterise(const std::vector<Segment>& segments, const std::string& material, MaterialKind kind, double voxel,
                     const Progress& progress = {});

} // namespace volcomp
