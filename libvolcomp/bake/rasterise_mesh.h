// SPDX-License-Identifier: Apache-2.0
// From triangles to voxels, by coverage (MODEL section 2), as rasterise() does for what is grown.
//
// With the area A that a sheet has in a voxel of edge h, after its picture has cut it:
//   - a sheet covers c = A / (2 h^2), the mean over all directions, times the factor on flat shapes
//     of its width (rasterise.h);
//   - a body thinner than its voxels has two sides for each ray: c = A / (4 h^2), times the factor
//     on round strands of its radius, or on flat shapes as far as its normals agree. The radius is
//     2 V / A of the 27 voxels around, V their volume inside;
//   - a body of more than 0.7 h radius: c is the part of the voxel inside, less what rays that
//     graze its border meet too much; so its inside is full, and no light comes through. Between
//     0.5 h and 0.7 h the two are blended.
// All are at most 0.99, and each sheet adds -ln(1 - c) / h. Bodies count together as one.
//
// The direction is the principal normal of the triangles, not of the file's corners: the same
// direction says how much of a ray is blocked. Voxels inside bodies have that, and the colour, of
// the surface nearest to them.
#pragma once

#include "volcomp/base/progress.h"
#include "volcomp/bake/mesh_model.h"
#include "volcomp/volume/volume.h"

namespace volcomp {

/// Returns one part of a volume as rasterise() does, of a kind of surface. The same for any number
/// of threads. Throws Error if the voxels are too many or too far out, or the voxel is below
/// kSmallestVoxel.
VolumePart rasteriseMesh(const MeshModel& model, const MeshModelPart& part, double voxel,
                         const Progress& progress = {});

/// Returns the edge of a voxel for a mesh that gives none: half the width of the narrow sheets (the
/// lower quartile by area), but 1/256 of the longest side at least and 1/128 at most.
double voxelFor(const MeshModel& model);

} // namespace volcomp
