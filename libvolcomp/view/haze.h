// SPDX-License-Identifier: Apache-2.0
// Haze: air that glows evenly and hides what is far away (MODEL section 3).
#pragma once

#include "volcomp/base/vec.h"

namespace volcomp {

/// The [haze] table. The default is clear air.
struct Haze {
    Vec3d colour{0.7, 0.75, 0.8}; ///< radiance that very much of it shows, linear RGB
    double density = 0;           ///< optical depth of a metre at the height `base`; 0: no haze
    double height = 0; ///< over which it falls to 1/e, upwards, world units; 0: even everywhere
    double base = 0;   ///< y at which the density is `density`, world units

    bool none() const { return density == 0; }
    /// Throws Error if a value is out of range or not finite.
    void validate() const;
};

/// The haze along one ray from the eye. Threads that trace a ray have their own.
class HazeRay {
public:
    HazeRay() = default; ///< clear air
    /// `direction` has unit length. World units.
    HazeRay(const Haze& haze, const Vec3d& origin, const Vec3d& direction);

    /// The optical depth of the haze between the ray's origin and a distance (>= 0, may be
    /// infinite): the density's integral in closed form. Infinite where the haze never ends; never
    /// NaN.
    double depth(double distance) const;
    /// What it lets through of that way, 0 to 1.
    double transmittance(double distance) const;
    /// What is seen of `radiance` that comes from a distance, through the haze.
    Vec3d seen(const Vec3d& radiance, double distance) const
    {
        const double clear = transmittance(distance);
        return clear * radiance + (1 - clear) * m_colour;
    }
    const Vec3d& colour() const { return m_colour; } ///< Haze::colour

private:
    Vec3d m_colour{0.0};
    double m_density = 0, m_per_height = 0; ///< 1 / height, 0 if even
    double m_start = 0;                     ///< heights over the base that the ray begins at ...
    double m_rise = 0;                      ///< ... and rises by for each unit of distance
};

} // namespace volcomp
