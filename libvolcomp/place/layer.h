// A layer: one kind of box over one surface, with the second densities that say where, how large
// and in what colour (MODEL section 7).
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "volcomp/surface/second_density.h"
#include "volcomp/base/vec.h"

namespace volcomp {

enum class Sampling {
    area, ///< even on the surface; density counts boxes per square of the world unit
    uv    ///< even in the map, as the paper has it; density counts boxes per cell
};
enum class Sheets { all, first };
enum class TintAt { root, voxel };
enum class CombSpace {
    tangent, ///< x along growing u, y along growing v
    world
};

/// One [[layer]] of the scene: which boxes stand where on a surface, and how.
struct Layer {
    std::string name;
    std::string box;     ///< name of a primitive
    std::string surface; ///< name of a surface
    std::uint64_t seed = 1;

    Sampling sampling = Sampling::area;
    double density = 0;               ///< where the second density is 1
    int cells_u = 256, cells_v = 256; ///< Sampling::uv
    Sheets sheets = Sheets::all;      ///< where a projected line meets the surface several times
    std::vector<MapFactor> where;     ///< second density, clamped to 0 ... 1
    std::vector<MapFactor> size;      ///< multiplies the scale
    std::vector<MapFactor> colour;    ///< multiplies the box's colour
    TintAt tint = TintAt::root;

    std::pair<double, double> scale{1, 1}; ///< drawn evenly
    std::pair<double, double> turn{
        0, 2 * kPi}; ///< about the box's axis; 0: its +X faces the comb direction
    std::pair<double, double> tilt{0, 0}; ///< of the axis, to a random side, after the comb
    bool combed = false;
    Vec3d comb{0, -1,
               0}; ///< world direction in which the axis leans; its part along the surface counts
    std::filesystem::path
        comb_map; ///< instead: red, green, blue of an image, 0 ... 1 meaning -1 ... 1
    CombSpace comb_space = CombSpace::tangent; ///< of comb_map
    double comb_angle = kPi / 4;               ///< from the normal to the axis
    double upright =
        0;             ///< of the axis, before the comb: 0 along the normal, 1 along the world's +Y
    double offset = 0; ///< of the root along the normal

    void validate() const;
};

} // namespace volcomp
