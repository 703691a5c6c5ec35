// From a primitive to a box of voxels, by coverage (MODEL sections 2 and 6): grow(), then
// rasterise() for each material.
#pragma once

#include <vector>

#include "volcomp/grow/grow.h"
#include "volcomp/volume/material.h"
#include "volcomp/grow/growth_rule.h"
#include "volcomp/base/progress.h"
#include "volcomp/volume/volume.h"

namespace volcomp {

/// Grows and bakes variant `variant` (0 ... primitive.variants - 1). One part for each material
/// that something grew of. Deterministic for any number of threads. The box is as large as what
/// grows: nothing is cut off. Throws Error where the primitive is out of range, names an unknown
/// material or would exceed its number of segments.
Box bake(const GrowthRule& primitive, const std::vector<Material>& materials, int variant,
         const Progress& progress = {});

/// Edge of a voxel for a primitive that gives none, metres: half the width of the thin pieces (the
/// lower quartile by length), or 1/256 of the longest side of what it grows, whichever is larger:
/// finer voxels would show what no picture of the whole box shows.
double voxelFor(const Skeleton& skeleton);

/// What a file says about the box that it holds: the primitive's parameters, as metadata.
openvdb::MetaMap boxMetadata(const GrowthRule& primitive, int variant);

} // namespace volcomp
