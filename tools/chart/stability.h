// SPDX-License-Identifier: Apache-2.0
// How rounding spoils the light of a slab that is thin, by method.
#pragma once

#include "tools/chart/chart.h"

namespace volcomp {

/// Returns the error of a lit slab of 32 voxels against (1 - e^-32x) S for each method, where x is
/// the optical depth of a voxel.
ChartPanel stabilityPanel();

} // namespace volcomp
