// SPDX-License-Identifier: Apache-2.0
// What a voxel's particles are made of: the constants of MODEL sections 4 and 5 (paper, equations
// (5) to (11)).
#pragma once

#include <string>

#include "volcomp/base/vec.h"

namespace volcomp {

/// Which of the two reflection models a material follows, and so what its direction grid holds.
enum class MaterialKind {
    fibre,  ///< direction is the tangent, section 5; grid `tangentu`
    surface ///< direction is the normal, section 4; grid `N`
};

/// How particles reflect, as a [material.NAME] table says; MODEL section 4.
struct Material {
    std::string name;
    MaterialKind kind = MaterialKind::fibre;
    double alpha = 0.8; ///< weight of the diffuse (body) reflection, >= 0
    double beta = 0.3;  ///< weight of the specular reflection, >= 0
    double gamma =
        0.2;         ///< half width at half maximum of the highlight, radians, clamped to >= 0.001
    double n = 1.55; ///< refractive index, > 0
    Vec3d specular_colour{1.0}; ///< e, linear RGB
    /// Of kind surface alone: the factor kappa on the body colour that light from the other side is
    /// seen with, linear RGB, >= 0; alpha + kappa <= 1 where it is not 0 (MODEL section 4).
    Vec3d transmission{0.0};

    /// Throws Error if a value is out of range or not finite.
    void validate() const;
};

} // namespace volcomp
