// SPDX-License-Identifier: Apache-2.0
// The stage *place*: surfaces, and the boxes that stand on them (MODEL section 7).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "volcomp/base/progress.h"
#include "volcomp/place/layer.h"
#include "volcomp/place/placement.h"
#include "volcomp/surface/second_density.h"
#include "volcomp/surface/surface.h"

namespace volcomp {

/// One kind of box: its variants differ by their random numbers alone.
struct BoxKind {
    std::string name;
    int variants = 1;
};

/// A surface of the scene, loaded.
struct PlacedSurface {
    std::string name;
    Surface surface;
    SkinSpec skin;             ///< without a material: no skin
    SecondDensity skin_colour; ///< of skin.maps
};

/// A layer of the scene, and what composing looks up for its boxes.
struct PlacedLayer {
    Layer layer;
    std::int32_t surface = 0;  ///< index into PlacedScene::surfaces; -1 for a groom, which has none
    SecondDensity tint;        ///< colour at each voxel
    bool tints_voxels = false; ///< if false, `tint` is not used: Placement::tint says all
    std::size_t boxes = 0;     ///< number of boxes that were scattered
};

/// All that compose() needs beside the boxes themselves. It owns everything that it refers to, and
/// refers to it by index, so it may be moved. It cannot be copied: surfaces are large.
struct PlacedScene {
    std::vector<PlacedSurface> surfaces;
    std::vector<PlacedLayer> layers;
    /// Placement::box counts the variants of these kinds, one kind after the other.
    std::vector<BoxKind> kinds;
    PlacementList boxes;
    /// What a person should know of the layers, one sentence each: those without a box, and those
    /// whose density asks for less than one.
    std::vector<std::string> warnings;
};

/// What place() keeps beyond what compose() needs.
struct PlaceOptions {
    bool keep_uvs = false; ///< PlacementList::uvs, for writePlacements()
};

/// Loads the surfaces and scatters the layers over them, in the order of `layers`. `progress`
/// covers both. Throws Error if a layer names a surface or a kind that is not given, if a skin's or
/// a layer's map needs texture coordinates that its mesh lacks, if there are more than kMostBoxes
/// boxes, and as loadSurface() and scatter() do.
PlacedScene place(const std::vector<SurfaceSpec>& surfaces, const std::vector<Layer>& layers,
                  std::vector<BoxKind> kinds, const PlaceOptions& options = {},
                  const Progress& progress = {});

/// A scene of nothing but boxes that the caller has placed, without surfaces, layers and kinds.
PlacedScene placedBoxes(std::vector<Placement> placements);

/// "NAME_VARIANT", variants counted from 1, for each box that Placement::box may name.
std::vector<std::string> boxNames(const std::vector<BoxKind>& kinds);

} // namespace volcomp
