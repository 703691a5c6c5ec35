// From a primitive to a box of voxels, by coverage (MODEL sections 2 and 6).
#pragma once

#include <vector>

#include "material.h"
#include "primitive.h"
#include "progress.h"
#include "volume.h"

namespace volcomp {

/// Grows and bakes variant `variant` (0 ... primitive.variants - 1). Deterministic for any number of threads.
/// Throws Error where the primitive is out of range, names an unknown material or would exceed its number of segments.
Box bake(const Primitive& primitive, const std::vector<Material>& materials, int variant, const Progress& progress = {});

} // namespace volcomp
