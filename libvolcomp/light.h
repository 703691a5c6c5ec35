// Lights (MODEL section 4): a white diffuse surface that faces a light shows the light's strength.
#pragma once

#include <string>
#include <vector>

#include "vec.h"

namespace volcomp {

class TableReader;

enum class LightKind { directional, point, spot };

struct Light {
    std::string name;
    LightKind kind = LightKind::directional;
    Vec3d direction{0, -1, 0};    ///< the way the light travels, unit; directional and spot
    Vec3d position{0, 0, 0};      ///< point and spot
    Vec3d strength{1, 1, 1};      ///< linear RGB; for point and spot at distance 1
    double angle = 0.5;           ///< spot: from its axis to where it is dark, radians
    double soft_angle = 0.05;     ///< spot: width of the border, inside `angle`, radians

    void validate() const;
};

/// Reads one [[light]] table.
Light readLight(TableReader& table, int index);

} // namespace volcomp
