// SPDX-License-Identifier: Apache-2.0
// A box that another program has modelled: the mesh file, and what its parts are made of.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "volcomp/base/vec.h"
#include "volcomp/base/words.h"
#include "volcomp/grow/file_axes.h"

namespace volcomp {

/// Whether a part of a mesh is filled inside.
enum class Solidity {
    automatic, ///< if it is closed but for holes that are small against it (bake/mesh_model.h)
    solid,
    sheet
};
constexpr Word<Solidity> kSolidityWords[] = {
    {"auto", Solidity::automatic}, {"solid", Solidity::solid}, {"sheet", Solidity::sheet}};

/// One [[box.NAME.mesh_material]]: what some of a mesh's triangles are made of.
struct MeshMatch {
    /// The triangles whose material, object, group or node has this name; * stands for any letters
    /// and ? for any one.
    std::string name = "*";
    std::string material;          ///< of the scene
    std::filesystem::path texture; ///< instead of the file's; empty: the file's
    std::filesystem::path alpha;   ///< picture that cuts them out; empty: as `texture` says
    double cutoff = -1;            ///< alpha below it is cut out; below 0: the file's, or 1/2
    Vec3d colour{1.0};             ///< factor on the colour, linear RGB
    Solidity solidity = Solidity::automatic;
};

/// Where a box comes from that is not grown.
struct MeshBox {
    std::filesystem::path file; ///< empty: the box is grown
    FileAxes axes;
    Vec3d move{0.0};                  ///< added after the axes, metres: the box's root is at 0 then
    std::vector<MeshMatch> materials; ///< the first that matches counts
};

/// Whether a name is what a pattern with * and ? says. Time grows with the product of their
/// lengths at most.
bool matches(std::string_view pattern, std::string_view name);

} // namespace volcomp
