// SPDX-License-Identifier: Apache-2.0
// A box or a groom of strands that another program has made, as a scene describes it.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "volcomp/base/vec.h"
#include "volcomp/grow/file_axes.h"

namespace volcomp {

/// The keys of a [groom.NAME] table, and of a [box.NAME] with `curves`.
struct CurvesSpec {
    std::filesystem::path file;
    /// A groom stands where its file says, in so many pieces; otherwise the strands are cut into
    /// tufts, which are the variants of a box.
    bool groom = false;
    FileAxes axes;
    Vec3d move{0.0};  ///< added to every point of a groom, world units
    double width = 0; ///< metres, of strands whose file gives no widths; 0: its default
    /// Colours where the file has none for strands or points, linear RGB.
    std::optional<Vec3d> colour_root, colour_tip;
    bool file_colours = true; ///< whether the file's colours count
    std::filesystem::path
        colour_map;          ///< multiplies the colours, at (u,v) of the root; may be empty
    std::vector<int> groups; ///< that are taken; empty: all
    bool use_guides = false;
};

} // namespace volcomp
