// SPDX-License-Identifier: Apache-2.0
// From radiance to what a screen shows: exposure and a tone curve, for PNG and previews alone.
#pragma once

#include "volcomp/base/words.h"

namespace volcomp {

enum class Tone {
    none,  ///< radiance 1 is white, and so is all above it
    filmic ///< highlights roll off: filmic()
};
constexpr Word<Tone> kToneWords[] = {{"none", Tone::none}, {"filmic", Tone::filmic}};

/// The [picture] table: how linear pixels are shown. The default changes nothing.
struct Look {
    double exposure = 0; ///< stops: +1 doubles the radiance
    Tone tone = Tone::none;

    /// What is shown of a linear colour channel, linear again: 0 to 1 is from black to white.
    double shown(double radiance) const;
    bool operator!=(const Look& other) const
    {
        return exposure != other.exposure || tone != other.tone;
    }
    /// Throws Error if the exposure is not within -100 to 100.
    void validate() const;
};

/// The filmic curve of J. Hable (Uncharted 2: HDR Lighting, GDC 2010), ((x(Ax+CB)+DE)/(x(Ax+B)+DF))
/// - E/F over its value at W, with his constants A = 0.15, B = 0.50, C = 0.10, D = 0.20, E = 0.02,
/// F = 0.30 and W = 11.2. The scale of x is such that mid grey stays: filmic(0.18) = 0.18. Black
/// stays black, with a slope of 1.12 there; 1 becomes 0.613; kFilmicWhite and all above it is
/// white. It rises everywhere below that. Negative values and NaN become 0.
double filmic(double radiance);
constexpr double kFilmicWhite = 3.8257600843307817; ///< the least radiance that is white

} // namespace volcomp
