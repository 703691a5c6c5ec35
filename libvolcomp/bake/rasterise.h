// SPDX-License-Identifier: Apache-2.0
// From strands and leaves to voxels, by coverage (MODEL section 2).
//
// Each strand covers a part c of a voxel's cross-section, at most 0.99, and adds the density
// -ln(1 - c) / h, where h is the edge of the voxel. With the radius r, and l the exact length of
// the axis in the voxel:
//   - thin round strands: c = (pi/4) 2 r l / h^2, the mean over all directions, times a factor of
//     1 to 1.18. From r = h/8 on the strand is spread over its cross-section.
//   - thick round strands (r > 0.58 h): c is the part of the voxel that is filled, so that their
//     inside is full too.
//   - flat shapes: c = area / (2 h^2), the mean over all directions, times a factor that rises with
//     the width from 1 to about 2: a wide leaf is opaque from everywhere.
// Pieces of one strand in one voxel are summed (thin, flat) or joined (thick) before the logarithm,
// so that neither joints nor the number of pieces count. The factors make up for the voxels that
// one strand fills, which are no strands at random; they stand in leaf_filler.cpp, their errors in
// docs/baking.md.
//
// How few strands a voxel holds is kept as its own share (VolumePart::own_share).
#pragma once

#include <vector>

#include "volcomp/grow/grow.h"
#include "volcomp/volume/material.h"
#include "volcomp/base/progress.h"
#include "volcomp/volume/volume.h"

namespace volcomp {

/// The edge of the smallest voxel, metres: OpenVDB's transforms want its cube to be above 3e-15.
constexpr double kSmallestVoxel = 1.5e-5;

/// Returns one part of a volume: density (per metre), direction, own share and colour of `segments`
/// in voxels of edge `voxel` (metres), with the given material and kind. The direction is the
/// density-weighted principal tangent (fibre) or normal (surface). The colour grid is null if all
/// segments have one colour. The grids are as large as the segments need. The values do not depend
/// on the number of threads or on the machine. Throws Error if the voxels do not fit into OpenVDB's
/// index space (coordinates beyond 2^19) or are far too many, the voxel is below kSmallestVoxel or
/// a segment is not finite.
VolumePart rasterise(const std::vector<Segment>& segments, const std::string& material,
                     MaterialKind kind, double voxel, const Progress& progress = {});

} // namespace volcomp
