// How placements become one volume.
#pragma once

namespace volcomp {

class TableReader;

struct ComposeParams {
    double voxel = 0;              ///< edge of a voxel, world units; 0: from the camera and the picture
    double minimum_density = 0;    ///< voxels below it are not kept, 1 / length

    void validate() const;
};

/// Reads the [compose] table.
ComposeParams readCompose(TableReader& table);

} // namespace volcomp
