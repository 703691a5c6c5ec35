// SPDX-License-Identifier: Apache-2.0
#include "volcomp/base/portable_math.h"

#include <cfloat>
#include <cmath>
#include <limits>

#include "volcomp/base/interval.h"

namespace volcomp::portable {
namespace {

static_assert(std::numeric_limits<double>::is_iec559 && FLT_EVAL_METHOD == 0,
              "boxes are the same on every machine only where double is IEEE 754's, unextended");

constexpr double kPi = 0x1.921fb54442d18p+1;

// Taylor series of sin x = x + x^3 kSine(x^2) and cos x = 1 + x^2 kCosine(x^2); enough terms for
// |x| <= pi/4.
constexpr double kSine[] = {
    -1.0 / 6,        1.0 / 120,        -1.0 / 5040,          1.0 / 362880,
    -1.0 / 39916800, 1.0 / 6227020800, -1.0 / 1307674368000, 1.0 / 355687428096000};
constexpr double kCosine[] = {-1.0 / 2,
                              1.0 / 24,
                              -1.0 / 720,
                              1.0 / 40320,
                              -1.0 / 3628800,
                              1.0 / 479001600,
                              -1.0 / 87178291200,
                              1.0 / 20922789888000,
                              -1.0 / 6402373705728000};
// e^x = 1 + x + x^2 kExponential(x), for |x| <= log(2) / 2.
constexpr double kExponential[] = {
    1.0 / 2,     1.0 / 6,      1.0 / 24,      1.0 / 120,      1.0 / 720,       1.0 / 5040,
    1.0 / 40320, 1.0 / 362880, 1.0 / 3628800, 1.0 / 39916800, 1.0 / 479001600, 1.0 / 6227020800};
// log((1 + s) / (1 - s)) = 2 s + 2 s^3 kLogarithm(s^2), for |s| <= 0.172.
constexpr double kLogarithm[] = {1.0 / 3,  1.0 / 5,  1.0 / 7,  1.0 / 9,  1.0 / 11,
                                 1.0 / 13, 1.0 / 15, 1.0 / 17, 1.0 / 19, 1.0 / 21};
// atan t = t + t^3 kArcTangent(t^2), for |t| <= tan(pi / 32).
constexpr double kArcTangent[] = {-1.0 / 3,  1.0 / 5,  -1.0 / 7, 1.0 / 9,
                                  -1.0 / 11, 1.0 / 13, -1.0 / 15};

template <int N>
double polynomial(const double (&coefficients)[N], double x)
{
    double sum = coefficients[N - 1];
    for (int k = N - 2; k >= 0; --k) sum = coefficients[k] + x * sum;
    return sum;
}

// The angle less the nearest multiple of pi/2, and which multiple (0 to 3).
struct Reduced {
    double angle;
    int quarter;
};

Reduced reduced(double x)
{
    // pi/2 in three parts. The first two have 33 bits, so that their products are exact up to
    // |x| = 1e6 (Cody and Waite, Software manual for the elementary functions, 1980).
    constexpr double kHigh = 0x1.921fb544p+0, kMiddle = 0x1.0b4611a6p-34,
                     kLow = 0x1.3198a2e037073p-69;
    const double k = std::floor(x * 0x1.45f306dc9c883p-1 + 0.5);
    const double angle = ((x - k * kHigh) - k * kMiddle) - k * kLow;
    return {angle, static_cast<int>(k - 4 * std::floor(k / 4))};
}

double sineOf(double x) { return x + x * x * x * polynomial(kSine, x * x); }
double cosineOf(double x) { return 1 + x * x * polynomial(kCosine, x * x); }

// sin(x + turns * pi/2)
double sine(const Reduced& x, int turns)
{
    switch ((x.quarter + turns) & 3) {
    case 0:
        return sineOf(x.angle);
    case 1:
        return cosineOf(x.angle);
    case 2:
        return -sineOf(x.angle);
    default:
        return -cosineOf(x.angle);
    }
}

// log 2 in two parts; the products of the first with exponents are exact.
constexpr double kLog2High = 0x1.62e42fefa38p-1, kLog2Low = 0x1.ef35793c7673p-45;

// For t in [0, 1]. The angle is halved three times: tan(a / 2) = t / (1 + sqrt(1 + t^2)).
double arcTangent(double t)
{
    for (int k = 0; k < 3; ++k) t = t / (1 + std::sqrt(1 + t * t));
    return 8 * (t + t * t * t * polynomial(kArcTangent, t * t));
}

} // namespace

double sin(double x) { return sine(reduced(x), 0); }
double cos(double x) { return sine(reduced(x), 1); }

double atan2(double y, double x)
{
    const double a = std::abs(x), b = std::abs(y);
    if (a == 0 && b == 0) return 0;
    double angle = b <= a ? arcTangent(b / a) : kPi / 2 - arcTangent(a / b);
    if (x < 0) angle = kPi - angle;
    return y < 0 ? -angle : angle;
}

double acos(double x) { return 2 * portable::atan2(std::sqrt(1 - x), std::sqrt(1 + x)); }

double exp(double x)
{
    if (x < -708) return 0;
    if (x > 709.7) return kInfinity;
    const double k = std::floor(x * 0x1.71547652b82fep+0 + 0.5);
    const double r = (x - k * kLog2High) - k * kLog2Low;
    return std::ldexp(1 + (r + r * r * polynomial(kExponential, r)), static_cast<int>(k));
}

double log(double x)
{
    if (!(x > 0)) return x == 0 ? -kInfinity : std::numeric_limits<double>::quiet_NaN();
    if (x == kInfinity) return x;
    int exponent = 0;
    double m = std::frexp(x, &exponent);
    if (m < 0x1.6a09e667f3bcdp-1) { // sqrt(1/2): m in [0.707, 1.414]
        m *= 2;
        --exponent;
    }
    const double s = (m - 1) / (m + 1), z = s * s;
    return exponent * kLog2High
        + (2 * s + (2 * s * z * polynomial(kLogarithm, z) + exponent * kLog2Low));
}

// What the rounding of 1 + x loses is put right by a factor (Kahan; Hewlett-Packard HP-15C Advanced
// functions handbook, 1982).
double log1p(double x)
{
    const double u = 1 + x;
    return u == 1 ? x : portable::log(u) * (x / (u - 1));
}

double pow(double x, double y) { return x == 0 ? 0 : portable::exp(y * portable::log(x)); }

} // namespace volcomp::portable
