// SPDX-License-Identifier: Apache-2.0
// Ground: a plane or a height field as a mesh.
#pragma once

#include <filesystem>

#include "volcomp/surface/mesh.h"

namespace volcomp {

/// A rectangle in x and z around the origin whose normal is +Y. u runs along +X and v along -Z, so
/// a map stands upright for an eye above that has -Z up. World units.
struct TerrainSpec {
    double width = 0, depth = 0;      ///< along x and z; 0: no terrain
    std::filesystem::path height_map; ///< an image whose luminance is the height; empty: flat
    double low = 0, high = 1;         ///< heights where the map is 0 and 1
    int cells = 128;                  ///< number of squares along the longer side
};

/// Makes the terrain's mesh with texture coordinates, two triangles for each square; prepareMesh()
/// adds the normals. Throws Error for sizes that are not positive and if the map cannot be read.
Mesh makeTerrain(const TerrainSpec& spec);

} // namespace volcomp
