// SPDX-License-Identifier: Apache-2.0
// The inner loops of the sweep: 16 x 16 rays of a light on their way through one layer of leaves.
//
// They work on plain arrays and are compiled once for each instruction set (Highway); the best one
// for the machine is chosen when they are called. Every target computes the same bits: no lane
// looks at another, and no multiplication is contracted with an addition.
#pragma once

#include <cstdint>

namespace volcomp {

/// The rays of one bundle. Ray (i, j) crosses a plane at b[i], c[j]; the bundle's neighbours begin
/// with its last row and its last column.
struct RayBundle {
    static constexpr int kSide = 16, kRays = kSide * kSide;
    static constexpr int kStep = kSide - 1; ///< rays from one bundle to the next

    alignas(64) double b[kSide], c[kSide]; ///< at the plane at hand, voxels from the strip's corner
    alignas(64) double b_slope[kSide], c_slope[kSide]; ///< for each slice of travel; -1 to 1
};

/// Density x travel along each ray of a bundle, j fastest.
struct alignas(64) RaySums {
    float values[RayBundle::kRays] = {};
};

/// The densities under a bundle in one layer of leaves: kLeafDim slices across the light's axis, of
/// rows along c. At least kMargin floats before and behind the rows may be read; they have weight
/// 0.
struct Strip {
    static constexpr int kMaxLeaves = 4; ///< along b, and along c
    static constexpr int kEdge = kMaxLeaves * 8, kSize = kEdge * kEdge * 8; ///< in floats
    static constexpr int kMargin = 2 * kEdge + RayBundle::kSide;

    const float* first_slice; ///< the lowest corner of the slice that the light enters first
    int slice_stride;         ///< to the slice that it enters next; negative if the light goes down
    int row_stride;           ///< to the row one voxel on in b
};

/// Moves the rays on through `slices` slices of the strip, of which the light goes `first_way`
/// voxels of travel (0 to 1) through the first and 1 through each other one. Adds what each ray
/// meets to `sums`; rays at most 2/3 voxel apart. Leaves the rays where they are behind the last
/// slice, and returns the least of the sums.
float pushRays(const Strip& strip, int slices, double first_way, RayBundle& rays, RaySums& sums);

/// Writes the codes of each `stride`th ray along both axes, j fastest: 255 times the root of the
/// transmittance, rounded. `extinction` is the optical depth of density 1 over one voxel. A code is
/// off by 0.6 at most: 0.5 by rounding, 0.1 by the exponential.
void encodeTransmittances(const RayBundle& rays, const RaySums& sums, double extinction, int stride,
                          std::uint8_t* codes);

} // namespace volcomp
