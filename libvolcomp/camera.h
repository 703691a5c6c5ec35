// Where the picture is taken from.
#pragma once

#include "vec.h"

namespace volcomp {

class TableReader;

enum class Projection { perspective, orthographic };

struct Camera {
    Projection projection = Projection::perspective;
    Vec3d eye{0, 0, 5};
    Vec3d target{0, 0, 0};
    Vec3d up{0, 1, 0};
    double field_of_view = 0.6981317007977318; ///< horizontal, radians, perspective
    double width = 2;                          ///< horizontal extent, world units, orthographic

    void validate() const;

    /// Edge of the square that one pixel of a picture `width_pixels` wide covers at the point `p`, world units.
    double pixelFootprint(const Vec3d& p, int width_pixels) const;
};

/// Reads the [camera] table.
Camera readCamera(TableReader& table);

} // namespace volcomp
