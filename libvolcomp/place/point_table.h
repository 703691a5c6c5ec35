// SPDX-License-Identifier: Apache-2.0
// Places that another program has chosen, read from a file.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "volcomp/base/vec.h"

namespace volcomp {

/// Where one box stands; world space and world units.
struct GivenPlace {
    Vec3d position{0.0};
    std::optional<Vec3d> normal; ///< the box's axis, unit
    /// The box's X and Y axes, unit and at right angles; then nothing else turns the box.
    std::optional<std::pair<Vec3d, Vec3d>> axes;
    double scale = 1; ///< > 0
    int variant = -1; ///< counted from 0; -1: drawn at random
    Vec3f tint{1.0f}; ///< linear RGB
    std::string box;  ///< "NAME_VARIANT", as lists of volcomp-compose have it; empty: any
};

/// Reads places from PLY, CSV or JSON.
///
/// PLY: the vertices, ASCII or binary of either order; their element comes first. CSV: a line of
/// names and then a line of numbers for each place, separated by commas; lines that begin with #
/// are left out. JSON: an array of objects, as volcomp-compose --placements writes it.
///
/// The names are x y z; nx ny nz, the normal; qx qy qz qw, the rotation as a quaternion, of any
/// length; scale; variant, from 1; red green blue, linear RGB, of PLY's integers divided by their
/// greatest value; box, a name NAME_VARIANT (in PLY the number of a comment "box NUMBER NAME"). In
/// JSON position, normal, rotation and tint are arrays, and x_axis and y_axis give the rotation.
/// Everything but the position may be missing, and other names are left out.
///
/// Throws Error, with the file and the place, for anything that is not finite, of another form or
/// incomplete, a scale that is not above 0, and a rotation or normal of no length.
std::vector<GivenPlace> readPlaces(const std::filesystem::path& file);

} // namespace volcomp
