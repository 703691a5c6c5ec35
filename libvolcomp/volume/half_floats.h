// SPDX-License-Identifier: Apache-2.0
// Conversion of floats to half floats, many at a time.
#pragma once

#include <array>
#include <cstddef>

#include <openvdb/Types.h>

namespace volcomp {

/// Three half floats, as files keep directions and colours. Each component is off by at most 2^-11
/// of itself (2^-25 below 2^-14).
using Half3 = std::array<openvdb::math::half, 3>;

/// Writes `count` half floats, each rounded to the nearest, and to the even one of two equally
/// near. The bits are the same on every machine. Beyond 65520 the result is infinite.
void toHalf(const float* from, openvdb::math::half* to, std::size_t count);

/// The same for `count` vectors whose components are given as three arrays.
void toHalf3(const float* x, const float* y, const float* z, Half3* to, std::size_t count);

} // namespace volcomp
