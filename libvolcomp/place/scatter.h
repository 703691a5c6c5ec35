// Where boxes stand: stratified samples over a surface, kept with the probability of the second
// density (MODEL section 7).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "volcomp/place/layer.h"
#include "volcomp/base/progress.h"
#include "volcomp/surface/surface.h"
#include "volcomp/base/vec.h"

namespace volcomp {

/// One box placed: the reference that the composite is made from.
struct Placement {
    Vec3f x_axis{1, 0, 0}, y_axis{0, 1, 0},
        z_axis{0, 0, 1}; ///< unit, right-handed; the box's axes in the world
    Vec3d position{0.0}; ///< of the box's root
    float scale = 1;
    Vec3f tint{1.0f};     ///< multiplies the box's colour
    std::int32_t box = 0; ///< index into the boxes given to compose()
    std::int32_t layer = 0;
    Vec2f uv{0.0f, 0.0f};       ///< of the place on the surface below the root
    std::int32_t triangle = -1; ///< of the surface; -1: none
};

/// Which of the boxes given to compose() a layer uses.
struct LayerBoxes {
    std::int32_t first = 0; ///< index of the kind's first variant
    std::int32_t count = 1; ///< variants, each as likely as another
};

/// Places the layer's boxes. A sample's random numbers depend on (layer.seed, layer.name, index of
/// the sample) alone: another map or layer leaves the other placements where they are. Placements
/// follow the samples' order, the same for any number of threads. Throws Error where a map needs
/// texture coordinates that the mesh lacks, a map's file is wrong, or more than 500 million samples
/// are asked for.
std::vector<Placement> scatter(const Surface& surface, const Layer& layer, const LayerBoxes& boxes,
                               int layer_index, const Progress& progress = {});

} // namespace volcomp
