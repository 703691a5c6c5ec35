// SPDX-License-Identifier: Apache-2.0
// From a growth rule to a box of voxels, by coverage (MODEL sections 2 and 6): grow(), then
// rasterise() for each material; or, if the rule names a mesh, loadMeshModel() and rasteriseMesh().
#pragma once

#include <vector>

#include "volcomp/grow/grow.h"
#include "volcomp/volume/material.h"
#include "volcomp/grow/growth_rule.h"
#include "volcomp/base/progress.h"
#include "volcomp/volume/volume.h"

namespace volcomp {

/// Grows, or cuts from the rule's curves, and bakes variant `variant` (0 ... rule.variants - 1).
/// The box has one part for each material that something grew of, and one without voxels if nothing
/// grew. It is as large as what grows: nothing is cut off. The same for any number of threads and
/// on every machine. OpenVDB must have been started (openvdb::initialize). Throws Error if the rule
/// or the variant is out of range, or the rule names an unknown material or would exceed its number
/// of segments, and as CurvePieces and loadMeshModel() do. What was mended in a mesh is in the
/// warnings of Box::volume.
Box bake(const GrowthRule& rule, const std::vector<Material>& materials, int variant,
         const Progress& progress = {});

/// Bakes what has grown or was cut already: a variant's `skeleton`, of one part or more. `voxel` is
/// the edge of a voxel in metres; 0: as voxelFor() chooses.
Box bakeSkeleton(Skeleton skeleton, const GrowthRule& rule, const std::vector<Material>& materials,
                 int variant, double voxel, const Progress& progress = {});

/// Returns the edge of a voxel in metres for a rule that gives none: half the width of the thin
/// pieces (the lower quartile by length), or 1/256 of the longest side of what grows, whichever is
/// larger. Finer voxels would show what no picture of the whole box shows. Returns 0.01 if nothing
/// grows.
double voxelFor(const Skeleton& skeleton);

/// Returns the metadata of a box's file: its name, variant and seed.
/// `variant` counts from 0, as in bake(), and the file from 1.
openvdb::MetaMap boxMetadata(const GrowthRule& rule, int variant);

} // namespace volcomp
