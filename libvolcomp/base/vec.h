// SPDX-License-Identifier: Apache-2.0
// Vectors are OpenVDB's: Vec3d for positions and directions, Vec3f for stored colours and
// directions.
#pragma once

#include <cmath>

#include <openvdb/math/Vec3.h>

namespace volcomp {

using openvdb::math::Vec3;
using Vec3d = openvdb::math::Vec3<double>;
using Vec3f = openvdb::math::Vec3<float>;

constexpr double kPi = 3.14159265358979323846;
constexpr double kDegree = kPi / 180; ///< radians in a degree
/// The angle between successive points of a sunflower's spiral, radians: pi (3 - sqrt(5)).
constexpr double kGoldenAngle = 2.399963229728653;

/// Returns 0, 1 or 2: the component of largest magnitude. Of equal ones, returns the first.
template <class T>
int largestAxis(const Vec3<T>& v)
{
    const T x = std::abs(v[0]), y = std::abs(v[1]), z = std::abs(v[2]);
    return x >= y ? (x >= z ? 0 : 2) : (y >= z ? 1 : 2);
}

/// Returns 0, 1 or 2: the smallest value. Of equal ones, returns the first.
inline int smallestOf(const double (&v)[3])
{
    return v[0] <= v[1] ? (v[0] <= v[2] ? 0 : 2) : (v[1] <= v[2] ? 1 : 2);
}

} // namespace volcomp
