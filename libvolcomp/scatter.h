// Where boxes stand: stratified samples over a surface, kept with the probability of the second density (MODEL section 7).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "layer.h"
#include "surface.h"
#include "vec.h"

namespace volcomp {

/// One box placed: the reference that the composite is made from.
struct Placement {
    Vec3f x_axis, y_axis, z_axis;   ///< unit; the box's axes in the world
    Vec3d position;                 ///< of the box's root
    float scale = 1;
    Vec3f tint{1.0f};               ///< multiplies the box's colour
    std::int32_t box = 0;           ///< index into the boxes given to compose()
    std::int32_t layer = 0;
};

} // namespace volcomp
