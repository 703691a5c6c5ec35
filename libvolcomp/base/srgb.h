// SPDX-License-Identifier: Apache-2.0
// The transfer function of sRGB (IEC 61966-2-1), for one channel; T is float or double.
#pragma once

#include <algorithm>
#include <cmath>

namespace volcomp {

/// Returns the linear value of an sRGB value, both 0 to 1.
template <class T>
T linearFromSrgb(T c)
{
    return c <= T(0.04045) ? c / T(12.92) : std::pow((c + T(0.055)) / T(1.055), T(2.4));
}

/// Returns the sRGB value, 0 to 1, of a linear value, which is clamped to 0 to 1. NaN gives 0.
template <class T>
T srgbFromLinear(T c)
{
    c = std::min(T(1), std::max(T(0), c));
    return c <= T(0.0031308) ? T(12.92) * c : T(1.055) * std::pow(c, 1 / T(2.4)) - T(0.055);
}

} // namespace volcomp
