// The names of grids and metadata that vdb_io.h documents, for its two sources.
#pragma once

#include "volcomp/volume/material.h"
#include "volcomp/volume/vdb_io.h"

namespace volcomp {

constexpr const char* kMaterial = "volcomp_material";
constexpr const char* kKind = "volcomp_kind";
constexpr const char* kColour = "volcomp_colour";
constexpr const char* kDirection = "volcomp_direction";
constexpr const char* kScatterRatio = "volcomp_scatter_ratio";

inline const char* directionName(MaterialKind kind)
{
    return kind == MaterialKind::fibre ? "tangentu" : "N";
}
inline const char* colourName(GridNames names)
{
    return names == GridNames::houdini ? "Cd" : "color";
}

} // namespace volcomp
