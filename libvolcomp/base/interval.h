// SPDX-License-Identifier: Apache-2.0
// Infinity, and intervals of numbers.
#pragma once

#include <limits>

namespace volcomp {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A closed interval of numbers. It has no bound on a side whose end is infinite.
struct Interval {
    double low, high;
};

} // namespace volcomp
