// A picture of the second densities: where boxes stand, and each map as it falls on the surface.
#pragma once

#include <vector>

#include "volcomp/view/camera.h"
#include "volcomp/view/image.h"
#include "volcomp/place/layer.h"
#include "volcomp/place/scatter.h"
#include "volcomp/surface/surface.h"

namespace volcomp {

/// One layer and what came of it; the pointers must live during the call.
struct SheetLayer {
    const Surface* surface;
    const Layer* layer;
};

/// Panels of width x height pixels side by side, seen by the camera: first the surfaces with a dot
/// for each placement, in a colour for each layer (red, green, blue, yellow, magenta, cyan, in
/// turn); then, for each layer, its second density as grey, and its colour map where it has one.
/// Labels name the layers, in their colours and with their numbers of boxes, and the maps.
Image placementSheet(const std::vector<const Surface*>& surfaces,
                     const std::vector<SheetLayer>& layers,
                     const std::vector<Placement>& placements, const Camera& camera, int width,
                     int height);

} // namespace volcomp
