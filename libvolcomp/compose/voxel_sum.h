// SPDX-License-Identifier: Apache-2.0
// What is added up in each voxel of a composite.
#pragma once

namespace volcomp {

/// What is added to a voxel, and what a voxel has: a cache line. The entries of `values` are named
/// by their first index; those that no name covers are zero.
struct alignas(64) VoxelSum {
    static constexpr int kDiagonal = 0; ///< xx, yy, zz of the sum of w t tᵀ; trace: about density
    static constexpr int kSquares = 3;  ///< sum over strands of (density of the strand)^2
    static constexpr int kMixed = 4;    ///< xy, yz, zx of that sum
    static constexpr int kColour = 8;   ///< red, green, blue, each times density
    static constexpr int kDensity = 11;
    static constexpr int kScatter = 12; ///< VolumePart::scatter_ratio, each times density

    float values[16];

    float density() const { return values[kDensity]; }
};
static_assert(sizeof(VoxelSum) == 64);

/// Cubes that are added to a tile together. Coordinates are the tile's: its cell i is [i, i+1).
struct CubeBatch {
    static constexpr int kSize = 64;

    alignas(64) float low[3][kSize]; ///< lowest corner, x y z
    VoxelSum sum[kSize];             ///< added where a cube covers a cell fully
};

} // namespace volcomp
