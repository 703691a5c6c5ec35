// SPDX-License-Identifier: Apache-2.0
#include "volcomp/view/haze.h"

#include <algorithm>
#include <cmath>

#include "volcomp/base/error.h"
#include "volcomp/base/interval.h"

namespace volcomp {

void Haze::validate() const
{
    const auto fail = [](const char* expected) {
        throw Error(std::string("haze: expected ") + expected);
    };
    if (!(colour[0] >= 0 && colour[1] >= 0 && colour[2] >= 0 && std::isfinite(colour.lengthSqr())))
        fail("a finite colour >= 0");
    if (!(density >= 0 && std::isfinite(density))) fail("a finite density >= 0");
    if (!(height >= 0 && std::isfinite(height))) fail("a finite height >= 0");
    if (!std::isfinite(base)) fail("a finite base");
}

namespace {

/// The number, not so far out that products and sums of such are NaN.
double kept(double x)
{
    constexpr double kFar = 1e150;
    return std::clamp(x, -kFar, kFar);
}

} // namespace

HazeRay::HazeRay(const Haze& haze, const Vec3d& origin, const Vec3d& direction)
    : m_colour(haze.colour), m_density(haze.density),
      m_per_height(haze.height > 0 ? kept(1 / haze.height) : 0),
      m_start(kept(kept(origin[1] - haze.base) * m_per_height)), m_rise(direction[1] * m_per_height)
{
}

double HazeRay::depth(double distance) const
{
    constexpr double kMost = 600; // e^600 is less than the greatest double
    if (m_density == 0 || !(distance > 0)) return 0;
    // The density at the lower end, where it is greatest; upwards from there it falls as
    // exp(-rise x). A ray that goes down for ever meets all the haze there is.
    if (std::isinf(distance) && m_rise <= 0) return kInfinity;
    const double lowest = m_start + std::min(0.0, kept(m_rise * distance)),
                 greatest = m_density * std::exp(std::clamp(-lowest, -kMost, kMost)),
                 rise = std::abs(m_rise);
    if (std::isinf(distance)) return greatest / rise;
    const double x = rise * distance;
    return greatest * (x > 1e-12 ? -std::expm1(-x) / rise : distance);
}

double HazeRay::transmittance(double distance) const { return std::exp(-depth(distance)); }

} // namespace volcomp
