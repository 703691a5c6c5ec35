// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/shade.h"

#include <algorithm>
#include <cmath>

namespace volcomp {
namespace {

constexpr double kLn2 = 0.693147180559945309417;
constexpr double kMinGamma = 0.001;  // rad
constexpr double kMinCosine = 0.01;  // cos theta_r and cos theta_Q in denominators
constexpr double kDegenerate = 1e-6; // V + L or Q - (t.Q)t shorter than this has no direction

double acosClamped(double x) { return std::acos(std::min(1.0, std::max(-1.0, x))); }

double distribution(const Lobe& lobe, double phi) { return std::exp(-lobe.falloff * phi * phi); }

// What surfaces with normals that lie evenly show of diffuse light, as a matt sphere does, for the
// cosine of the angle between eye and light.
double evenDiffuse(double cosine)
{
    const double angle = acosClamped(cosine);
    return 2 / (3 * kPi) * (std::sin(angle) + (kPi - angle) * cosine);
}

// For a normal on the side of V.
Reflection reflect(const Lobe& lobe, const Vec3d& N, const Vec3d& V, const Vec3d& L)
{
    const double cos_i = N.dot(L);
    if (!(cos_i > 0)) return {0, 0, -cos_i};
    Reflection result{lobe.body * cos_i, 0, 0};
    Vec3d Q = V + L;
    const double length = Q.length();
    if (lobe.beta == 0 || length < kDegenerate) return result;
    Q /= length;
    const double cos_phi = N.dot(Q), cos_q = V.dot(Q);
    const double r = std::max(N.dot(V), kMinCosine), q = std::max(cos_q, kMinCosine);
    const double g_over_r = std::min({1 / r, 2 * cos_phi / q, 2 * cos_phi * cos_i / (q * r)});
    result.specular = lobe.beta * distribution(lobe, acosClamped(cos_phi)) * fresnel(cos_q, lobe.n)
        * std::max(0.0, g_over_r);
    return result;
}

} // namespace

Lobe makeLobe(const Material& m, double spread, bool normalised)
{
    const double gamma = std::max(m.gamma, kMinGamma), k = m.kind == MaterialKind::fibre ? 2 : 1;
    const double wide = gamma * gamma + 2 * kLn2 * k * k * spread * spread;
    const double alpha = normalised && m.kind == MaterialKind::fibre ? m.alpha / kPi : m.alpha;
    return {alpha, m.beta * gamma / std::sqrt(wide), kLn2 / wide, m.n, spread * spread, m.alpha};
}

double fresnel(double c, double n)
{
    if (n == 1) return 0;
    const double g2 = n * n + c * c - 1;
    if (g2 < 0) return 1;
    const double g = std::sqrt(g2);
    if (g + c == 0) return 1;
    const double a = (g - c) / (g + c), b = (c * (g + c) - 1) / (c * (g - c) + 1);
    return 0.5 * a * a * (1 + b * b);
}

Reflection reflectSurface(const Lobe& lobe, Vec3d N, const Vec3d& V, const Vec3d& L)
{
    if (N.dot(V) < 0) N = -N;
    Reflection result = reflect(lobe, N, V, L);
    const double s2 = lobe.spread_square;
    if (s2 == 0) return result;
    const double even = 3 * s2 / (1 + 2 * s2), seen = (1 - even) * N.dot(V), seen_even = 0.5 * even;
    const auto mean = [&](double cos_i, double cosine) {
        return (seen * std::max(0.0, cos_i) + seen_even * evenDiffuse(cosine)) / (seen + seen_even);
    };
    result.diffuse = lobe.body * mean(N.dot(L), V.dot(L));
    result.transmitted = mean(-N.dot(L), -V.dot(L));
    return result;
}

Reflection reflectSided(const Lobe& lobe, const Vec3d& N, const Vec3d& V, const Vec3d& L)
{
    if (!(N.dot(V) > 0)) return {};
    Reflection result = reflect(lobe, N, V, L);
    result.transmitted = 0;
    return result;
}

Reflection reflectFibre(const Lobe& lobe, const Vec3d& t, const Vec3d& V, const Vec3d& L)
{
    const double tl = t.dot(L), tv = t.dot(V);
    // Of tangents around t the mean square cosine to L is (tl^2 (1 - s^2) + s^2) / (1 + 2 s^2).
    const double sine_square = (L - tl * t).lengthSqr(), s2 = lobe.spread_square;
    Reflection result{lobe.alpha * std::sqrt((sine_square * (1 - s2) + 2 * s2) / (1 + 2 * s2)), 0,
                      0};
    Vec3d Q = V + L;
    const double length = Q.length();
    if (lobe.beta == 0 || length < kDegenerate) return result;
    Q /= length;
    Vec3d normal = Q - t.dot(Q) * t;
    const double cos_phi = normal.length();
    if (cos_phi < kDegenerate) return result;
    normal /= cos_phi;
    const double cos_i = normal.dot(L), cos_r = normal.dot(V);
    if (cos_i <= 0 || cos_r <= 0) return result;
    const double phi = acosClamped(tv) - acosClamped(-tl); // (11), misprint corrected
    const double cos_q = std::sqrt(std::max(0.0, (1 + V.dot(L)) / 2)),
                 q = std::max(cos_q, kMinCosine);
    const double g = std::min({1.0, 2 * cos_phi * cos_r / q, 2 * cos_phi * cos_i / q});
    result.specular = lobe.beta * distribution(lobe, phi) * fresnel(cos_q, lobe.n) * g;
    return result;
}

} // namespace volcomp
