// SPDX-License-Identifier: Apache-2.0
// Elementary functions with the same result on every machine.
//
// The standard library's sin, exp and the like differ in the last bits between versions of glibc,
// and within one version between processors with and without fused multiply-add. These use only
// operations that IEEE 754 rounds correctly (+ - * / sqrt), in a fixed order; the build switches
// contraction off (-ffp-contract=off). They are within 4 units in the last place of the exact
// value, unless stated otherwise. Growing and baking call no others: the same seed gives the same
// box everywhere (MODEL section 6). Allocate nothing and throw nothing.
#pragma once

namespace volcomp::portable {

/// Sine and cosine of an angle in radians. Beyond |x| = 1e6 the error grows to 1e-16 |x|.
double sin(double x);
double cos(double x);

/// The angle of the point (x, y) in radians, -pi to pi; 0 at the origin.
double atan2(double y, double x);

/// The angle in [0, pi] whose cosine is x, for x in [-1, 1].
double acos(double x);

/// e^x; 0 below the smallest normal number, infinity above the largest.
double exp(double x);

/// Natural logarithm; -infinity at 0, NaN below.
double log(double x);

/// log(1 + x), also for x near 0; x > -1.
double log1p(double x);

/// x^y for x >= 0 and y > 0, within (4 + |y log x|) units in the last place.
double pow(double x, double y);

} // namespace volcomp::portable
