// SPDX-License-Identifier: Apache-2.0
// Light from all around, ambient and dome, as a voxel shows it (MODEL section 5b): a sum over the
// 26 directions of Openness.
#pragma once

#include <array>

#include "volcomp/base/vec.h"
#include "volcomp/render/render_params.h"
#include "volcomp/render/shade.h"
#include "volcomp/render/sky/openness.h"
#include "volcomp/volume/material.h"

namespace volcomp {

/// What comes from the directions of Openness, prepared once. World axes. The last two of each row
/// are padding for vectors.
struct SkyTable {
    using Row = std::array<float, 28>;
    Row x{}, y{}, z{};             ///< of the directions
    Row weight{};                  ///< Openness::weights()
    std::array<Row, 3> radiance{}; ///< R, G, B: the mean over the directions nearest to each
};
/// For a volume with these axes (world, unit).
SkyTable makeSkyTable(const RenderParams& params, const VoxelTree& tree);

/// What of it arrives at a place.
struct SkyAtPlace {
    SkyTable::Row passes{}; ///< weight times what passes from each direction
    double open = 1;        ///< sum of these, 1 - P
    Vec3d radiance{0.0};    ///< mean that arrives
};
/// `openness` may be null: everything arrives. `p` is in world space.
SkyAtPlace skyAt(const SkyTable& sky, const Openness* openness, const Vec3d& p);

/// How the particles of a voxel take light by its direction.
struct SkyResponse {
    enum class Kind {
        even,    ///< alike from all sides: no direction
        fibre,   ///< `direction` is the tangent
        surface, ///< `direction` is the normal; the side of the eye shows alpha, the other one
                 ///< kappa
        sided    ///< `direction` is the normal of what has one side
    };
    Kind kind;
    Vec3d direction;
    double spread_square;
};

/// What a voxel shows of the sky, as radiance. `albedo` is alpha c_b, `transmitted` is kappa c_b,
/// `V` leads to the eye. With `bounces` light that is scattered more than once is in it.
Vec3d showSky(const SkyTable& sky, const SkyAtPlace& place, const SkyResponse& response,
              const Vec3d& albedo, const Vec3d& transmitted, const Vec3d& V, bool bounces);

} // namespace volcomp
