// Strands and leaves to voxels, by coverage (MODEL section 2).
//
// Each strand covers the part c of a voxel's cross-section and adds the density -ln(1 - c) / h, c
// at most 0.99:
//   thin round strands                c = (pi/4) 2 r l / h^2, l the exact length in the voxel:
//   direction averaged, and exactly conserved
//                                     up to r = h/8; above, spread over the cross-section and
//                                     raised by up to a quarter at r = 0.58 h
//   thick round strands (r > 0.58 h)  c = the part of the voxel that is filled, so that their
//   inside is full too flat shapes                       c = area / (2 h^2) where they are narrower
//   than a voxel (direction averaged), rising slowly to
//                                     area / h^2: a wide leaf is opaque from everywhere
// Pieces of one strand in one voxel are summed (thin, flat) or joined (thick) before the logarithm:
// neither joints nor the number of pieces count. The corrections, fitted to exactly traced
// cylinders and leaves, stand with their errors in rasterise.cpp.
#pragma once

#include <vector>

#include "volcomp/grow/grow.h"
#include "volcomp/volume/material.h"
#include "volcomp/base/progress.h"
#include "volcomp/volume/volume.h"

namespace volcomp {

/// The smallest voxel that OpenVDB's transforms hold: the cube of the edge must not be below 3e-15.
/// Metres.
constexpr double kSmallestVoxel = 1.5e-5;

/// One part of a volume: density, direction and colour of `segments` in voxels of edge `voxel`
/// (metres), material and kind as given. The direction is the density-weighted principal tangent
/// (fibre) or normal (surface). The colour grid is null where all segments have one colour. The
/// grids are as large as the segments need. The bytes do not depend on the number of threads.
/// Throws Error where the voxels would not fit into OpenVDB's index space (coordinates beyond
/// 2^19), the voxel is below kSmallestVoxel or a segment is not finite.
VolumePart rasterise(const std::vector<Segment>& segments, const std::string& material,
                     MaterialKind kind, double voxel, const Progress& progress = {});

} // namespace volcomp
