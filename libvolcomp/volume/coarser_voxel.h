// SPDX-License-Identifier: Apache-2.0
// One voxel that stands for eight (MODEL section 8).
#pragma once

#include <array>

namespace volcomp {

/// The light that a voxel scatters once, over that of a homogeneous voxel of the same density and
/// own share: for light that comes from the side of the eye, from across, and from behind.
using ScatterRatio = std::array<float, 3>;
constexpr ScatterRatio kHomogeneous{1, 1, 1};

/// A voxel that stands for 2 x 2 x 2.
struct CoarserVoxel {
    /// The mean over the axes of -ln of the mean transmittance of the four columns along the axis,
    /// divided by their length; 1 / world length.
    double density;
    /// Mean over the axes. Particles that lie in clumps shade each other and hide what they light,
    /// which the mean transmittance does not tell. 1 if the eight voxels are equal and have no own
    /// share.
    ScatterRatio scatter_ratio;
};

/// What is known of eight voxels, each list in the order 4 x + 2 y + z.
struct EightVoxels {
    EightVoxels() { scatter_ratios.fill(kHomogeneous); }

    std::array<double, 8> densities{};
    std::array<ScatterRatio, 8> scatter_ratios;
    /// VolumePart::own_share: what is a strand's own does not shade it.
    std::array<double, 8> own_shares{};
    /// By voxel and axis: the share of the voxel beside it that is the same strand or leaf, which
    /// hides the voxel from the eye, but does not shade it.
    std::array<std::array<double, 3>, 8> same_beside{};
};

/// `extinction` is the optical depth of density 1 over one of the eight; with 0 the density is the
/// mean density. `own_share` is that of the coarser voxel.
CoarserVoxel coarserVoxel(const EightVoxels& fine, double own_share, double extinction);

/// The scatter ratio of a voxel of another `density` that stands for the eight.
ScatterRatio scatterRatioOf(const EightVoxels& fine, double density, double own_share,
                            double extinction);

} // namespace volcomp
