// SPDX-License-Identifier: Apache-2.0
// The ways to integrate (1) and (2) along a ray, one file for each. A new way declares its two
// functions here, and depthAlong() and Integrator choose it.
//
// MarchRays are in the coordinates of the tree that the way walks: corner coordinates for
// VoxelTree, half a voxel less for DualTree. `direction` is the ray's direction in world axes, unit
// length.
//
// ...Depth() returns the optical depth along the ray. It may stop, and return what it has, as soon
// as the depth exceeds that of MarchScene::stop.
// trace...() adds what the ray sees to `sample`, behind what that has seen, until less than
// RenderParams::cutoff of the light passes.
#pragma once

#include "volcomp/render/march/march_scene.h"
#include "volcomp/render/march/segment.h"

namespace volcomp {

// exact.cpp: every voxel has one density (box filter).
double exactDepth(const MarchScene& scene, const MarchRay& r, const Vec3d& direction);
/// The same along a ray that begins in voxel `cell` or on its faces and crosses a few leaves at
/// most. Only the ray's origin, direction and length matter.
double exactShortDepth(const MarchScene& scene, const MarchRay& r, const int* cell,
                       const Vec3d& direction);
void traceExact(const MarchScene& scene, const MarchRay& r, const Vec3d& direction,
                RaySample& sample, RayScratch& scratch);

// trilinear.cpp: densities are interpolated between voxel centres; needs MarchScene::dual.
double trilinearDepth(const MarchScene& scene, const MarchRay& r, const Vec3d& direction);
void traceTrilinear(const MarchScene& scene, const MarchRay& r, const Vec3d& direction,
                    RaySample& sample, RayScratch& scratch);

// sums.cpp: the paper's sums (3) and (4) with either filter.
double sumDepth(const MarchScene& scene, const MarchRay& r, const Vec3d& direction);
void traceSums(const MarchScene& scene, const MarchRay& r, const Vec3d& direction,
               RaySample& sample, RayScratch& scratch);

/// The optical depth along the ray, integrated as the scene's settings say.
double depthAlong(const MarchScene& scene, const MarchRay& r, const Vec3d& direction);

} // namespace volcomp
