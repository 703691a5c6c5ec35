// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/tree/coarser_voxel.h"

#include <algorithm>
#include <cmath>

namespace volcomp {
namespace {

using Eight = std::array<double, 8>;
using Axes = std::array<double, 3>;

// The voxel beside k along an axis.
int beside(int k, int axis) { return k ^ 4 >> axis; }

// -ln of the mean transmittance of the columns along an axis, for columns that let too little
// through for 1 - opacity. The least depth is taken out of the sum, as e^-depth underflows at 745.
double darkDepth(const Eight& depths, int axis)
{
    const int along = 4 >> axis;
    double columns[4];
    int count = 0;
    for (int k = 0; k < 8; ++k)
        if (!(k & along)) columns[count++] = depths[k] + depths[k | along];
    const double least = *std::min_element(columns, columns + 4);
    double sum = 0;
    for (const double depth : columns) sum += std::expm1(least - depth) / 4;
    return least - std::log1p(sum);
}

// The sum over the axes of -ln of the columns' mean transmittance.
double depthOfColumns(const Eight& depths, const Eight& opacity)
{
    double pairs[3] = {0, 0, 0}, sum = 0;
    for (const double o : opacity) sum += o;
    for (int k = 0; k < 8; ++k)
        for (int axis = 0; axis < 3; ++axis)
            if (!(k & 4 >> axis)) pairs[axis] += opacity[k] * opacity[beside(k, axis)];
    double closed[3]; // mean opacity of the columns along each axis
    for (int axis = 0; axis < 3; ++axis) closed[axis] = (sum - pairs[axis]) / 4;
    if (std::max({closed[0], closed[1], closed[2]}) < 0.999)
        return -std::log1p(
            -(closed[0] + (1 - closed[0]) * (closed[1] + (1 - closed[1]) * closed[2])));
    double total = 0;
    for (int axis = 0; axis < 3; ++axis) total += darkDepth(depths, axis);
    return total;
}

// Single scattering in a homogeneous cube of optical depth d across, of opacity 1 - e^-d, in a beam
// through the whole of it: seen from the light, from across, from behind.
ScatterRatio homogeneous(double d, double opacity)
{
    return {float(opacity * (2 - opacity) / 2), float(opacity * opacity / d),
            float(d * (1 - opacity))};
}

// Single scattering in the eight voxels, in a beam into each face with light along the axes: what
// each voxel adds, behind and beside the others.
Axes scattered(const Eight& depths, const Eight& opacity,
               const std::array<ScatterRatio, 8>& scatter_ratios)
{
    Axes light{0, 0, 0};
    for (int k = 0; k < 8; ++k) {
        if (!(opacity[k] > 0)) continue;
        double passes[3], squares = 0, both = 0; // through the neighbour along each axis
        for (int axis = 0; axis < 3; ++axis) {
            passes[axis] = 1 - opacity[beside(k, axis)];
            both += passes[axis];
            squares += passes[axis] * passes[axis];
        }
        const ScatterRatio own = homogeneous(depths[k], opacity[k]);
        const double a = 1 + passes[0], b = 1 + passes[1], c = 1 + passes[2];
        light[0] += double(scatter_ratios[k][0]) * own[0] * (3 + squares) / 24;
        light[1] += double(scatter_ratios[k][1]) * own[1] * (a * b + a * c + b * c) / 48;
        light[2] += double(scatter_ratios[k][2]) * own[2] * both / 12;
    }
    return light;
}

} // namespace

CoarserVoxel coarserVoxel(const Eight& densities, const std::array<ScatterRatio, 8>& scatter_ratios,
                          double extinction)
{
    double mean = 0;
    for (const double density : densities) mean += density / 8;
    if (!(extinction > 0) || !(mean > 0)) return {mean, kHomogeneous};
    Eight depths, opacity;
    double sum = 0;
    for (int k = 0; k < 8; ++k) {
        depths[k] = extinction * densities[k];
        opacity[k] = depths[k] > 0 ? -std::expm1(-depths[k]) : 0;
        sum += opacity[k];
    }
    const double total = depthOfColumns(depths, opacity);
    CoarserVoxel v{total / (6 * extinction), kHomogeneous};
    const Axes fine = scattered(depths, opacity, scatter_ratios);
    const ScatterRatio even = homogeneous(total / 3, -std::expm1(-total / 3));
    for (int i = 0; i < 3; ++i)
        if (even[i] > 1e-6f * float(sum)) v.scatter_ratio[i] = float(fine[i] / double(even[i]));
    return v;
}

} // namespace volcomp
