// Vectors are OpenVDB's: Vec3d for positions and directions, Vec3f for stored colours and
// directions.
#pragma once

#include <openvdb/math/Vec3.h>

namespace volcomp {

using openvdb::math::Vec3;
using Vec3d = openvdb::math::Vec3<double>;
using Vec3f = openvdb::math::Vec3<float>;

constexpr double kPi = 3.14159265358979323846;
constexpr double kDegree = kPi / 180; ///< radians in a degree

} // namespace volcomp
