// SPDX-License-Identifier: Apache-2.0
#include "volcomp/place/layer.h"

#include <algorithm>
#include <cmath>

#include "volcomp/base/error.h"

namespace volcomp {

double Mask::at(double x) const
{
    const double beyond = std::max(low - x, x - high);
    if (beyond <= 0) return 1;
    return beyond < fade ? 1 - beyond / fade : 0;
}

void Layer::validate() const
{
    const auto fail = [&](const char* what) {
        throw Error("layer '" + name + "': expected " + what);
    };
    const auto span = [](const std::pair<double, double>& s) {
        return std::isfinite(s.first + s.second) && s.first <= s.second;
    };
    if (!(density >= 0 && std::isfinite(density))) fail("a density >= 0");
    if (cells_u < 1 || cells_v < 1) fail("at least one cell each way");
    if (!span(scale) || !(scale.first > 0)) fail("a size [low, high] with 0 < low <= high");
    if (!span(turn) || !span(tilt)) fail("finite angles [low, high] with low <= high");
    if (!std::isfinite(offset) || !std::isfinite(comb_angle) || !std::isfinite(comb.lengthSqr()))
        fail("a finite offset, comb and comb_degrees");
    if (!(spacing >= 0 && std::isfinite(spacing))) fail("a spacing >= 0");
    for (const Mask* mask : {&slope, &height})
        if (!(mask->low <= mask->high && mask->fade >= 0)) fail("masks [low, high], low <= high");
    if (!std::isfinite(size_power)) fail("a finite size_power");
    if (!(upright >= 0 && upright <= 1)) fail("an upright from 0 to 1");
}

} // namespace volcomp
