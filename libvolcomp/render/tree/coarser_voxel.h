// SPDX-License-Identifier: Apache-2.0
// One voxel that stands for eight (MODEL section 8).
#pragma once

#include <array>

namespace volcomp {

/// The light that a voxel scatters once, over that of a homogeneous voxel of the same density: for
/// light that comes from the side of the eye, from across, and from behind.
using ScatterRatio = std::array<float, 3>;
constexpr ScatterRatio kHomogeneous{1, 1, 1};

/// A voxel that stands for 2 x 2 x 2.
struct CoarserVoxel {
    /// The mean over the axes of -ln of the mean transmittance of the four columns along the axis,
    /// divided by their length; 1 / world length.
    double density;
    /// Mean over the axes. Particles that lie in clumps shade each other and hide what they light,
    /// which the mean transmittance does not tell. 1 if the eight voxels are equal.
    ScatterRatio scatter_ratio;
};

/// `densities` and `scatter_ratios` are those of voxels 4 x + 2 y + z. `extinction` is the optical
/// depth of density 1 over one of the eight; with 0 the density is the mean density.
CoarserVoxel coarserVoxel(const std::array<double, 8>& densities,
                          const std::array<ScatterRatio, 8>& scatter_ratios, double extinction);

} // namespace volcomp
