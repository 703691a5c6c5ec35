// SPDX-License-Identifier: Apache-2.0
// The 26 directions from a cell of a grid to its neighbours, in the grid's axes.
#pragma once

#include <array>
#include <cmath>

#include "volcomp/base/vec.h"

namespace volcomp {

/// How many cells a direction goes along each axis: -1, 0 or 1.
using NeighbourStep = std::array<int, 3>;

/// Of direction 0 to 25.
inline NeighbourStep neighbourStep(int direction)
{
    const int n = direction < 13 ? direction : direction + 1; // 13 would be the cell itself
    return {n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1};
}
/// The number of a step that is not (0,0,0).
inline int neighbourNumber(const NeighbourStep& step)
{
    const int n = (step[0] + 1) * 9 + (step[1] + 1) * 3 + step[2] + 1;
    return n < 13 ? n : n - 1;
}
/// How many axes it goes along, 1 to 3; its length in cells is the root of this.
inline int neighbourAxes(const NeighbourStep& step)
{
    return std::abs(step[0]) + std::abs(step[1]) + std::abs(step[2]);
}

/// The share of the sphere that is nearer to this direction than to the other 25. The numbers are
/// sums over 4e7 places of an octant.
inline double neighbourWeight(int direction)
{
    constexpr double kAxis = 0.045777942, kEdge = 0.036980596,
                     kCorner = (1 - 6 * kAxis - 12 * kEdge) / 8;
    const int axes = neighbourAxes(neighbourStep(direction));
    return axes == 1 ? kAxis : axes == 2 ? kEdge : kCorner;
}

/// The direction that is nearest to `d`.
inline int nearestNeighbour(const Vec3d& d)
{
    int order[3] = {0, 1, 2}; // from the greatest component to the least
    const auto sort = [&](int i, int k) {
        if (std::abs(d[order[i]]) < std::abs(d[order[k]])) std::swap(order[i], order[k]);
    };
    sort(0, 1);
    sort(1, 2);
    sort(0, 1);
    int axes = 0;
    double sum = 0, best = -1;
    for (int n = 1; n <= 3; ++n) {
        sum += std::abs(d[order[n - 1]]);
        if (sum / std::sqrt(n) > best) {
            best = sum / std::sqrt(n);
            axes = n;
        }
    }
    NeighbourStep step{0, 0, 0};
    for (int n = 0; n < axes; ++n) step[order[n]] = d[order[n]] < 0 ? -1 : 1;
    return neighbourNumber(step);
}

} // namespace volcomp
