// Grids that several tests begin with.
#pragma once

#include "volcomp/volume/volume.h"

namespace volcomp {

/// A part without voxels, of density alone.
inline VolumePart emptyPart(double voxel = 1)
{
    VolumePart part;
    part.density = openvdb::FloatGrid::create(0.0f);
    part.density->setTransform(openvdb::math::Transform::createLinearTransform(voxel));
    return part;
}

/// One such part.
inline Volume emptyVolume(double voxel = 1)
{
    Volume volume;
    volume.parts.push_back(emptyPart(voxel));
    return volume;
}

} // namespace volcomp
