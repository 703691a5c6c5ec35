// A box's voxels packed for adding: what compose() walks through for every placement.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "volcomp/base/vec.h"
#include "volcomp/volume/volume.h"

namespace volcomp {

/// What an active voxel holds. Its directions, as a sum of w t tᵀ with trace `density`, are v vᵀ +
/// iso I: what a direction of length 1 - s stood for (volume.h), the eigenvalues across it taken as
/// equal.
struct alignas(16) SourceVoxel {
    float v[3] = {0, 0, 0}, iso = 0;
    float colour[3] = {0, 0, 0}; ///< times density
    float density = 0;           ///< 1 / box length, > 0
};

/// A cuboid along the box's axes, voxels of the part.
struct SourceBounds {
    Vec3f centre, half;
};

/// Bounds of many, component by component: centre x, y, z, half x, y, z.
struct BoundsList {
    static constexpr int kTogether =
        16; ///< length is a multiple of it; bounds beyond the last are empty
    std::vector<float> values[6];

    std::size_t size() const { return values[0].size(); }
};

/// One material of a box.
struct SourcePart {
    std::string material;
    MaterialKind kind = MaterialKind::fibre;
    double voxel = 1; ///< edge, box length
    bool has_direction = false;
    bool has_colour = false; ///< false: `colour` everywhere
    Vec3f colour{1.0f};
    SourceBounds bounds{Vec3f(0.0f), Vec3f(0.0f)}; ///< of all voxels' cubes
    float shift =
        0.5f; ///< voxel i holds what lies in [i - shift, i + 1 - shift), voxels of the part
    static constexpr int kRun = 16;
    std::vector<SourceVoxel> voxels; ///< neighbours in the list are neighbours in space
    std::vector<float> x, y, z; ///< their centres, in voxels of the part; padded to a multiple of
                                ///< kRun with places far away
    std::vector<BoundsList> bounds_of; ///< [0]: of the cubes of each kRun voxels; further: of each
                                       ///< kTogether of the bounds before
};

/// Packs the active voxels of positive density. Active tiles become voxels. Throws Error for NaN,
/// infinite or negative densities, and where the grid's transform is not a uniform scale alone.
SourcePart packPart(const VolumePart& part, const std::string& box_name);

/// The same with voxels of twice the edge, at the centre of mass of what they hold: density,
/// directions and colours are summed, so the integral and the place of thin things are kept. Eight
/// directions become one with its spread. For targets so coarse that the finer voxels would all
/// fall into one.
SourcePart coarsen(const SourcePart& part);

} // namespace volcomp
