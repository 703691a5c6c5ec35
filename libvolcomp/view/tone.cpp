// SPDX-License-Identifier: Apache-2.0
#include "volcomp/view/tone.h"

#include <algorithm>
#include <cmath>

#include "volcomp/base/error.h"

namespace volcomp {
namespace {

constexpr double kHableWhite = 11.2;

double hable(double x)
{
    constexpr double A = 0.15, B = 0.50, C = 0.10, D = 0.20, E = 0.02, F = 0.30;
    return (x * (A * x + C * B) + D * E) / (x * (A * x + B) + D * F) - E / F;
}

} // namespace

double filmic(double radiance)
{
    if (!(radiance > 0)) return 0;
    if (radiance >= kFilmicWhite) return 1;
    // Without max() black would be 1e-17 or so off.
    return std::max(0.0, hable(radiance * (kHableWhite / kFilmicWhite)) / hable(kHableWhite));
}

double Look::shown(double radiance) const
{
    const double exposed = exposure == 0 ? radiance : radiance * std::exp2(exposure);
    return tone == Tone::filmic ? filmic(exposed) : exposed;
}

void Look::validate() const
{
    if (!(exposure >= -100 && exposure <= 100))
        throw Error("picture: expected an exposure of -100 to 100 stops");
}

} // namespace volcomp
