// SPDX-License-Identifier: Apache-2.0
// Volumes that several tests begin with.
#pragma once

#include <cstdint>

#include "volcomp/base/random.h"
#include "volcomp/volume/volume.h"

namespace volcomp {

/// Returns a part that has a density grid without active voxels and no other grid. `voxel` is the
/// edge of a voxel in metres.
inline VolumePart emptyPart(double voxel = 1)
{
    VolumePart part;
    part.density = openvdb::FloatGrid::create(0.0f);
    part.density->setTransform(openvdb::math::Transform::createLinearTransform(voxel));
    return part;
}

/// Returns a volume of one such part.
inline Volume emptyVolume(double voxel = 1)
{
    Volume volume;
    volume.parts.push_back(emptyPart(voxel));
    return volume;
}

/// What noise() fills. Densities are uniform between 0 and `most`; a voxel is 1 m.
struct NoiseParams {
    openvdb::Coord origin{0}; ///< lowest corner of the cube
    int size = 8;             ///< edge of the cube, voxels
    double fill = 0.4;        ///< chance that a voxel is active
    double most = 1;          ///< upper bound of the densities, 1/m
    std::uint64_t seed = 1;
};

/// Returns a volume in which each voxel of a cube is active by chance and has a random density,
/// independent of its neighbours. The same parameters give the same volume.
inline Volume noise(const NoiseParams& params)
{
    Volume volume = emptyVolume();
    auto& tree = volume.parts[0].density->tree();
    Random random(params.seed);
    for (int x = 0; x < params.size; ++x)
        for (int y = 0; y < params.size; ++y)
            for (int z = 0; z < params.size; ++z)
                if (random.uniform() < params.fill)
                    tree.setValue(params.origin.offsetBy(x, y, z),
                                  static_cast<float>(params.most * random.uniform()));
    return volume;
}

} // namespace volcomp
