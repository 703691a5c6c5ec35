// SPDX-License-Identifier: Apache-2.0
// The voxels of a box as a list, which compose() walks through once for every placement and tile.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "volcomp/base/vec.h"
#include "volcomp/volume/coarser_voxel.h"
#include "volcomp/volume/volume.h"

namespace volcomp {

/// What an active voxel holds. The sum of its directions, as w t tᵀ with trace `density`, is
/// v vᵀ + iso I: what a direction of length 1 - spread stands for (volume.h), if the two
/// eigenvalues across it are equal. The entries of `values` are named by their first index.
struct alignas(16) SourceVoxel {
    static constexpr int kDirection = 0, kIso = 3; ///< v and iso
    static constexpr int kColour = 4;              ///< red, green, blue, each times density
    static constexpr int kDensity = 7;             ///< 1 / box length, > 0

    float values[8] = {};

    float* direction() { return values + kDirection; }
    const float* direction() const { return values + kDirection; }
    float& iso() { return values[kIso]; }
    float iso() const { return values[kIso]; }
    float* colour() { return values + kColour; }
    const float* colour() const { return values + kColour; }
    float& density() { return values[kDensity]; }
    float density() const { return values[kDensity]; }
};

/// A cuboid along the box's axes, in voxels of the part.
struct SourceBounds {
    Vec3f centre, half; ///< and half its edges
};

/// Bounds of many, component by component: centre x, y, z, half x, y, z. The length is a multiple
/// of kTogether; bounds that fill the list up are empty.
struct BoundsList {
    static constexpr int kTogether = 16;
    std::vector<float> values[6];

    std::size_t size() const { return values[0].size(); }
};

/// One material of a box.
struct SourcePart {
    static constexpr int kRun = 16;

    std::string box; ///< name, for messages
    std::string material;
    MaterialKind kind = MaterialKind::fibre;
    double voxel = 1; ///< edge, box length
    bool has_direction = false;
    bool has_colour = false; ///< false: every voxel has `colour`
    Vec3f colour{1.0f};
    SourceBounds bounds{Vec3f(0.0f), Vec3f(0.0f)}; ///< of all voxels' cubes
    /// Voxel i holds what lies in [i - shift, i + 1 - shift), in voxels of the part.
    float shift = 0.5f;
    std::vector<SourceVoxel> voxels; ///< neighbours in space are close in the list
    /// The sum over its strands of each voxel's (density of the strand)^2: own share times
    /// density^2. Empty: 0 everywhere.
    std::vector<float> squares;
    /// VolumePart::scatter_ratio of each voxel. Empty: 1 everywhere.
    std::vector<ScatterRatio> scatter_ratios;
    double dimension = 1; ///< in which its strands go on from voxel to voxel: specks 0, leaves 2
    /// Centres of the voxels, in voxels of the part. Places far away fill the lists up to a
    /// multiple of kRun.
    std::vector<float> x, y, z;
    /// [0] has the bounds of each kRun voxels' cubes, [n] those of each kTogether bounds of [n -
    /// 1]. The last list holds at most kTogether. Empty if there are no voxels.
    std::vector<BoundsList> bounds_of;

    /// How much of its own shade is left out of a strand's light: all of a fibre's, and of leaves'
    /// the more the more voxels they cover (MODEL section 3).
    double ownWeight() const;
    /// The density of voxel k for light along an axis of the box, as directed extinction has it.
    double densityAlong(std::uint32_t k, int axis) const;
};

/// Packs the active voxels of positive density. Active tiles become voxels. Throws Error if a
/// density is negative or anything is not finite, or if the grid's transform is not a uniform scale
/// alone. The message names the box.
SourcePart packPart(const VolumePart& part, const std::string& box_name);

} // namespace volcomp
