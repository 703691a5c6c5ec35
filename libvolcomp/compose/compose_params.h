// SPDX-License-Identifier: Apache-2.0
// How placements become one volume.
#pragma once

namespace volcomp {

/// The settings of compose(), as the [compose] table of a scene gives them.
struct ComposeParams {
    /// Edge of a voxel in world units. 0 stands for an edge that follows from the camera and the
    /// picture; compose() itself wants a number above 0.
    double voxel = 0;
    /// That edge in pixels, at the nearest point of a surface that the camera sees.
    double voxel_pixels = 0.5;
    /// Voxels are kept if their density, in 1 / length, is above this.
    double minimum_density = 0;
    /// And if their optical depth, density times edge, is above this, as in baking: less is not
    /// seen, and half floats do not hold it.
    double minimum_depth = 1e-5;
    /// Leaves out boxes that the camera does not see and no shadow needs.
    bool cull = false;

    /// Throws Error if a value is out of range.
    void validate() const;
};

} // namespace volcomp
