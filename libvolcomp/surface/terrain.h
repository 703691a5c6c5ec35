// Ground: a plane or a height field as a mesh.
#pragma once

#include <filesystem>

#include "volcomp/surface/mesh.h"

namespace volcomp {

/// A rectangle in x and z around the origin, its normal +Y; u runs along +X, v along -Z, so that
/// seen from above, with -Z up, a map stands upright.
struct TerrainSpec {
    double width = 0, depth = 0;      ///< along x and z, world units; 0: no terrain
    std::filesystem::path height_map; ///< luminance; empty: flat
    double low = 0, high = 1;         ///< height where the map is 0 and 1, world units
    int cells = 128;                  ///< along the longer side
};

/// The terrain with smooth normals and texture coordinates. Throws Error for sizes that are not
/// positive and for a wrong map.
Mesh makeTerrain(const TerrainSpec& spec);

} // namespace volcomp
