// Placements in files that other programs read.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "volcomp/place/scatter.h"

namespace volcomp {

/// Writes .json (an array of objects: box, layer, position, scale, x_axis, y_axis, z_axis, tint,
/// uv) or .ply (binary points: x y z, nx ny nz the box's axis, red green blue the tint, scale, box
/// and layer as numbers). `boxes` and `layers` name the indices. The file appears when it is
/// complete. Throws Error for another ending or a file that cannot be written.
void writePlacements(const std::filesystem::path& file, const std::vector<Placement>& placements,
                     const std::vector<std::string>& boxes, const std::vector<std::string>& layers);

} // namespace volcomp
