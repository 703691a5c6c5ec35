// SPDX-License-Identifier: Apache-2.0
// Grounds, cameras and boxes of the tests of placing.
#pragma once

#include "tests/support/volumes.h"
#include "volcomp/surface/surface.h"
#include "volcomp/surface/terrain.h"
#include "volcomp/view/camera.h"

namespace volcomp {

/// A square of edge `size` in y = `height`, its normal +Y.
inline Surface ground(double size, double height)
{
    TerrainSpec spec;
    spec.width = spec.depth = size;
    Mesh m = makeTerrain(spec);
    prepareMesh(m, 1, Vec3d(0, height, 0), Orientation::outward);
    return Surface(std::move(m), MapProjection{});
}

/// A camera at y = `height` that looks down at the origin; -Z is up in its picture.
inline Camera above(double height)
{
    Camera c;
    c.eye = Vec3d(0, height, 0);
    c.target = Vec3d(0, 0, 0);
    c.up = Vec3d(0, 0, -1);
    return c;
}

/// A box of one column of 20 voxels.
inline Box dot(double voxel)
{
    Box box{"dot", 0, {}};
    VolumePart part = emptyPart(voxel);
    part.material = "fur";
    for (int y = 0; y < 20; ++y) part.density->tree().setValue(openvdb::Coord(0, y, 0), 10.0f);
    box.volume.parts.push_back(part);
    return box;
}

} // namespace volcomp
