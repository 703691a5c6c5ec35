// SPDX-License-Identifier: Apache-2.0
// A layer: one kind of box over one surface, with the second densities that say where boxes stand,
// how large they are and in what colour (MODEL section 7).
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "volcomp/place/point_table.h"
#include "volcomp/surface/second_density.h"
#include "volcomp/base/vec.h"

namespace volcomp {

/// How samples are spread.
enum class Sampling {
    area, ///< evenly on the surface; the density counts boxes per square world unit
    uv    ///< evenly in the map, as in the paper; the density counts boxes per cell
};
/// Where boxes stand if a projected line meets the surface several times.
enum class Sheets {
    all,
    first ///< on the first sheet from outside
};
/// Where the colour map is looked up.
enum class TintAt {
    root, ///< once for a box, at its root
    voxel ///< at each voxel of a box
};
/// The axes of a comb map.
enum class CombSpace {
    tangent, ///< x along growing u, y along growing v
    world
};

/// How the sizes of boxes lie between the smallest and the largest.
enum class SizeDistribution {
    even,
    normal, ///< mean in the middle, standard deviation a quarter of the span, cut at its ends
    power   ///< the density goes with a power of the size
};

/// Numbers from `low` to `high`, and how far beyond these the chance of a box fades to 0.
struct Mask {
    double low = -1e300, high = 1e300, fade = 0;

    /// The chance at x, 0 to 1: linear over the fade.
    double at(double x) const;
};

/// Something that a layer's roots keep away from: those of another layer, or a surface.
struct Avoid {
    std::string layer, surface; ///< one of them is empty
    double distance = 1;        ///< of roots, world units
};

/// One [[layer]] of the scene: which boxes stand where on a surface, and how.
struct Layer {
    std::string name;
    std::string box;     ///< name of a kind of box
    std::string surface; ///< name of a surface
    std::uint64_t seed = 1;

    Sampling sampling = Sampling::area;
    double density = 0; ///< boxes where the second density is 1, in the unit that `sampling` says
    int cells_u = 256, cells_v = 256; ///< cells of the map, for Sampling::uv
    Sheets sheets = Sheets::all;
    std::vector<MapFactor> where;                    ///< the second density, clamped to 0 ... 1
    std::vector<MapFactor> size;                     ///< factors on the scale
    std::vector<MapFactor> colour;                   ///< factors on the box's colour
    TintAt tint = TintAt::root;                      ///< where `colour` is looked up
    std::vector<MapFactor> tilt_map, comb_angle_map; ///< factors on `tilt` and `comb_angle`

    /// Roots of scale 1 are no nearer than this to each other; two of other scales, or of two
    /// layers with a spacing, than the mean of both spacings times scales. World units; 0: any
    /// distance.
    double spacing = 0;
    std::vector<Avoid> avoid;
    Mask slope;  ///< angle of the surface's normal with +Y, radians
    Mask height; ///< of the place, along +Y, world units
    SizeDistribution sizes = SizeDistribution::even;
    double size_power = -2; ///< for SizeDistribution::power

    /// Instead of samples: places in a file (point_table.h), and places that are given. `density`
    /// is not used then, and `scale` and `colour` multiply what they say.
    std::filesystem::path points;
    std::vector<GivenPlace> places;

    bool hasPlaces() const { return !points.empty() || !places.empty(); }

    // Spans [low, high] of numbers that are drawn evenly for each box. Angles in radians.
    std::pair<double, double> scale{1, 1};
    /// Turn about the box's axis; at 0 its +X faces the comb direction.
    std::pair<double, double> turn{0, 2 * kPi};
    std::pair<double, double> tilt{0, 0}; ///< lean of the axis to a random side, after the comb

    bool combed = false;
    /// World direction in which the axes lean; only its part along the surface counts.
    Vec3d comb{0, -1, 0};
    /// An image instead of `comb`: 0 ... 1 of red, green and blue mean -1 ... 1 of x, y and z.
    std::filesystem::path comb_map;
    CombSpace comb_space = CombSpace::tangent; ///< of comb_map
    double comb_angle = kPi / 4;               ///< from the normal to the axis, radians
    /// The axis before the comb: 0 along the normal, 1 along the world's +Y.
    double upright = 0;
    double offset = 0; ///< height of the root above the surface, along the normal, world units

    /// The table as a scene has it, a line "KEY = VALUE" for each key, for recipes; may be empty.
    std::string source;

    /// Throws Error if a value is out of range or not finite. Maps check theirs when they are
    /// loaded.
    void validate() const;
};

} // namespace volcomp
