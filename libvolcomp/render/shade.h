// SPDX-License-Identifier: Apache-2.0
// Reflection of light by one voxel (MODEL sections 4 and 5; paper, equations (5) to (11); Torrance
// and Sparrow 1967, Cook and Torrance 1981).
//
// All vectors have unit length and point away from the voxel: V to the eye, L to the light. The
// result holds for a light of strength 1 that nothing attenuates: I = diffuse * c_b + specular * e
// + transmitted * c_t, where c_t is the transmission times c_b. It is finite and >= 0 for every
// input of unit length.
#pragma once

#include "volcomp/volume/material.h"
#include "volcomp/base/vec.h"

namespace volcomp {

/// What a voxel sends to the eye, as weights of the body colour c_b, the specular colour e and the
/// transmitted colour c_t.
struct Reflection {
    double diffuse = 0, specular = 0, transmitted = 0;

    /// The colour that is seen.
    Vec3d colour(const Material& material, const Vec3d& body) const
    {
        return diffuse * body + specular * material.specular_colour
            + transmitted * (material.transmission * body);
    }
};

/// The constants of a material at one spread of directions, prepared for evaluation.
struct Lobe {
    double alpha = 0, beta = 0;
    double falloff = 0; ///< ln 2 / gamma^2: D = exp(-falloff phi^2)
    double n = 1;
    double spread_square = 0;
    double body = 0; ///< alpha for surfaces and voxels without direction, never over pi
};

/// `spread` is that of the directions in a voxel, 0 if all agree (volume.h). It widens the lobe to
/// gamma'^2 = gamma^2 + 2 ln2 k^2 spread^2, with k = 2 for fibres and 1 for surfaces, and lowers it
/// by gamma / gamma' (MODEL section 8); the diffuse light of fibres follows it too (section 5). A
/// gamma below 0.001 rad counts as 0.001 rad.
///
/// `normalised` is for Scattering::multiple: the diffuse light of fibres is (10) over pi, so that a
/// fibre sends out alpha c_b of the light that it takes (section 5b).
Lobe makeLobe(const Material& material, double spread = 0, bool normalised = false);

/// MODEL section 4. The normal has no preferred side: if N.V < 0, -N is meant. Light from the other
/// side than V's is transmitted.
Reflection reflectSurface(const Lobe& lobe, Vec3d N, const Vec3d& V, const Vec3d& L);

/// As reflectSurface(), for a normal that has a side, such as a density's gradient: nothing is seen
/// from behind.
Reflection reflectSided(const Lobe& lobe, const Vec3d& N, const Vec3d& V, const Vec3d& L);

/// MODEL section 5. Tangents t and -t give the same. The diffuse light is that of the mean square
/// sine to the light of tangents with the lobe's spread around t.
Reflection reflectFibre(const Lobe& lobe, const Vec3d& t, const Vec3d& V, const Vec3d& L);

/// For a voxel without direction: I = alpha c_b / 4.
inline Reflection reflectIsotropic(const Lobe& lobe) { return {lobe.body / 4, 0, 0}; }

/// The Fresnel reflectance F of unpolarised light for the cosine c of the angle of incidence and
/// the refractive index n; 1 beyond the critical angle, 0 for n = 1.
double fresnel(double c, double n);

} // namespace volcomp
