// How placements become one volume.
#pragma once

namespace volcomp {

/// The settings of compose(), as the [compose] table says.
struct ComposeParams {
    double voxel = 0; ///< edge of a voxel, world units; 0: from the camera and the picture
    double voxel_pixels =
        0.5; ///< that voxel in pixels, at the nearest point of a surface that the camera sees
    double minimum_density = 0; ///< voxels not above it are not kept, 1 / length
    bool cull = false;          ///< leave out boxes that neither the camera sees nor a shadow needs

    void validate() const;
};

} // namespace volcomp
