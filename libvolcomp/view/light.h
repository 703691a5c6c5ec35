// SPDX-License-Identifier: Apache-2.0
// Lights (MODEL section 4). A white diffuse surface that faces a light shows the light's strength.
#pragma once

#include <string>
#include <vector>

#include "volcomp/base/vec.h"

namespace volcomp {

enum class LightKind { directional, point, spot, patch };

/// One [[light]] of the scene.
struct Light {
    std::string name;
    LightKind kind = LightKind::directional;
    Vec3d direction{0, -1, 0}; ///< the way the light travels, unit; directional, spot and patch
    Vec3d position{0, 0, 0};   ///< point, spot and patch; world units
    Vec3d strength{1, 1, 1};   ///< linear RGB; at distance 1, unless the light is directional
    double angle = 0.5;        ///< spot: from its axis to where it is dark, radians
    double soft_angle = 0.05;  ///< spot: width of the border, inside `angle`, radians
    double disc = 0;   ///< directional: whole angle of the disc that it shines from, radians
    double radius = 0; ///< point, spot and patch: of the ball or disc that shines, world units

    /// Whether it has a size: its shadows have soft borders (soft_light.h).
    bool isSoft() const { return kind == LightKind::directional ? disc > 0 : radius > 0; }
    /// Throws Error if a value is out of range or not finite, or a direction is not of unit length.
    void validate() const;
};

/// What arrives from a light at a point, if nothing is in between.
struct Illumination {
    Vec3d L;         ///< unit, from the point to the light
    double distance; ///< to the light, world units; infinite for a directional light
    double weight;   ///< factor on the light's strength: falloff and cone, >= 0
};

/// Returns what arrives from a light at the point `p`. All but directional lights fall off with the
/// square of the distance, which counts as at least `closest` (> 0), so that a light inside the
/// volume stays finite. The border of a spot is a smoothstep of the angle over soft_angle. A patch
/// is a small flat lamp, such as a window seen from afar: it shines into the half space in front of
/// it, with the cosine of the angle from its direction (Lambert's law). Wants a light that
/// Light::validate() accepts.
Illumination illuminate(const Light& light, const Vec3d& p, double closest);

} // namespace volcomp
