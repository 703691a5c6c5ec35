// SPDX-License-Identifier: Apache-2.0
// How placements become one volume.
#pragma once

#include "volcomp/base/words.h"

namespace volcomp {

/// What of a box stays the same where its voxels are spread over others or become coarser (MODEL
/// section 8).
enum class Kept {
    blocked_light, ///< the light that it blocks, mean over directions
    integral       ///< the integral of its density
};
constexpr Word<Kept> kKeptWords[] = {{"blocked_light", Kept::blocked_light},
                                     {"integral", Kept::integral}};

/// The settings of compose(), as the [compose] table of a scene gives them.
struct ComposeParams {
    /// Edge of a voxel in world units. 0 stands for an edge that follows from the camera and the
    /// picture; compose() itself wants a number above 0.
    double voxel = 0;
    /// That edge in pixels, at the nearest point of a surface that the camera sees.
    double voxel_pixels = 1;
    /// Voxels are kept if their density, in 1 / length, is above this.
    double minimum_density = 0;
    /// And if their optical depth, density times edge, is above this, as in baking: less is not
    /// seen, and half floats do not hold it.
    double minimum_depth = 1e-5;
    Kept keep = Kept::blocked_light; ///< at tau = 1
    /// Leaves out boxes that the camera does not see and no shadow needs.
    bool cull = false;

    /// Throws Error if a value is out of range.
    void validate() const;
};

} // namespace volcomp
