// SPDX-License-Identifier: Apache-2.0
#include "volcomp/volume/volume.h"

#include <fmt/format.h>

#include "volcomp/base/error.h"

namespace volcomp {

std::string negativeDensities(const std::string& grid, float least)
{
    return fmt::format("grid '{}' has densities below 0, down to {:g}; they count as 0", grid,
                       least);
}

openvdb::FloatGrid::ConstPtr withoutActiveTiles(const openvdb::FloatGrid::ConstPtr& density)
{
    if (!density->tree().hasActiveTiles()) return density;
    const openvdb::Index64 voxels =
        density->activeVoxelCount() - density->tree().activeLeafVoxelCount();
    if (voxels >> 27)
        throw Error(fmt::format(
            "grid '{}': expected tiles of a value that hold less than 2^27 voxels, found {} voxels",
            density->getName(), voxels));
    const auto copy = density->deepCopy();
    copy->tree().voxelizeActiveTiles();
    return copy;
}

openvdb::BBoxd boundsOf(const Box& box)
{
    openvdb::BBoxd bounds;
    for (const VolumePart& part : box.volume.parts) {
        const openvdb::CoordBBox b = part.density->evalActiveVoxelBoundingBox();
        if (b.empty()) continue;
        const double h = part.density->voxelSize()[0];
        bounds.expand(openvdb::BBoxd((b.min().asVec3d() - Vec3d(0.5)) * h,
                                     (b.max().asVec3d() + Vec3d(0.5)) * h));
    }
    return bounds;
}

} // namespace volcomp
