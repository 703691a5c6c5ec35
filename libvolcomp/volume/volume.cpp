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

} // namespace volcomp
