// SPDX-License-Identifier: Apache-2.0
// Where boxes stand: stratified samples over a surface, kept with the probability of the second
// density (MODEL section 7).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "volcomp/base/progress.h"
#include "volcomp/base/vec.h"
#include "volcomp/place/layer.h"
#include "volcomp/place/placement.h"
#include "volcomp/surface/surface.h"

namespace volcomp {

/// Which of the boxes given to compose() a layer uses.
struct LayerBoxes {
    std::int32_t first = 0; ///< index of the kind's first variant
    std::int32_t count = 1; ///< number of variants, each as likely as another
};

/// What scatter() keeps beside the placements themselves.
struct KeptPlaces {
    bool triangles = false; ///< PlacementList::triangles
    bool uvs = false;       ///< PlacementList::uvs
};

/// Throws Error if a value of the layer is out of range, or if scatter() would refuse it for the
/// number of its samples. Reads no maps.
void checkSamples(const Surface& surface, const Layer& layer);

/// Places one layer's boxes on its surface and appends them to `out`. A sample's random numbers
/// depend on (layer.seed, layer.name, index of the sample) alone, so another map or another layer
/// leaves the other placements where they are. Placements follow the order of the samples, and are
/// the same for any number of threads. Throws Error if a map needs texture coordinates that the
/// mesh lacks, if a map's file is wrong, if a value of the layer is out of range, or if more than
/// 500 million samples are asked for.
void scatter(const Surface& surface, const Layer& layer, const LayerBoxes& boxes, int layer_index,
             const KeptPlaces& kept, PlacementCollector& out, const Progress& progress = {});

/// The same for one layer alone, with all lists.
PlacementList scatter(const Surface& surface, const Layer& layer, const LayerBoxes& boxes = {},
                      int layer_index = 0);

} // namespace volcomp
