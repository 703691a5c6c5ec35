// A box's voxels packed for adding: what compose() walks through for every placement.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "vec.h"
#include "volume.h"

namespace volcomp {

/// One active voxel. Its directions, as a sum of w t tᵀ with trace `density`, are v vᵀ + iso I: what a direction of length 1 - s stood for
/// (volume.h), the eigenvalues across it taken as equal.
struct SourceVoxel {
    float x, y, z;    ///< centre, voxels of the part
    float density;    ///< 1 / box length, > 0
    float v[3], iso;
    float colour[3];  ///< times density
};

/// The voxels of one leaf of the box's tree.
struct SourceBlock {
    Vec3f centre, half;          ///< of the bounds of its voxels' cubes, voxels of the part
    std::uint32_t begin, end;    ///< in SourcePart::voxels
};

/// One material of a box.
struct SourcePart {
    std::string material;
    MaterialKind kind = MaterialKind::fibre;
    double voxel = 1;            ///< edge, box length
    bool has_direction = false;
    bool has_colour = false;     ///< false: `colour` everywhere
    Vec3f colour{1.0f};
    Vec3f centre{0.0f}, half{0.0f}; ///< bounds of all voxels' cubes
    float shift = 0.5f;          ///< voxel i holds what lies in [i - shift, i + 1 - shift), voxels of the part
    std::vector<SourceBlock> blocks;
    std::vector<SourceVoxel> voxels;
};

/// Packs the active voxels of positive density. Active tiles become voxels. Throws Error for NaN, infinite or negative densities, and where the grid's
/// transform is not a uniform scale alone.
SourcePart packPart(const VolumePart& part, const std::string& box_name);

/// The same with voxels of twice the edge, at the centre of mass of what they hold: density, directions and colours are summed, so the integral and the
/// place of thin things are kept. Eight directions become one with its spread. For targets so coarse that the finer voxels would all fall into one.
SourcePart coarsen(const SourcePart& part);

} // namespace volcomp
