// SPDX-License-Identifier: Apache-2.0
#include "volcomp/volume/coarser_voxel.h"

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
// through the whole of it: seen from the light, from across, from behind. What is one strand's own
// does not shade it.
ScatterRatio homogeneous(double d, double opacity, double own_share)
{
    const double shaded = 1 - own_share, lit = own_share * opacity;
    return {float(shaded * opacity * (2 - opacity) / 2 + lit),
            float(shaded * opacity * opacity / d + lit), float(shaded * d * (1 - opacity) + lit)};
}

// Single scattering in the eight voxels, in a beam into each face with light along the axes: what
// each voxel adds, behind and beside the others.
Axes scattered(const Eight& depths, const Eight& opacity, const EightVoxels& fine)
{
    const std::array<ScatterRatio, 8>& scatter_ratios = fine.scatter_ratios;
    Axes light{0, 0, 0};
    for (int k = 0; k < 8; ++k) {
        if (!(opacity[k] > 0)) continue;
        // What passes the neighbour along each axis, to the eye and of the light.
        double seen[3], lit[3], squares = 0, both = 0, crossed = 0;
        for (int axis = 0; axis < 3; ++axis) {
            const double o = opacity[beside(k, axis)];
            seen[axis] = 1 - o;
            lit[axis] = 1 - o * (1 - fine.same_beside[k][axis]);
            both += 0.5 * (seen[axis] + lit[axis]);
            squares += seen[axis] * lit[axis];
        }
        for (int i = 0; i < 3; ++i)
            crossed += 0.5 * (1 + seen[i]) * (2 + lit[(i + 1) % 3] + lit[(i + 2) % 3]);
        const ScatterRatio own = homogeneous(depths[k], opacity[k], fine.own_shares[k]);
        light[0] += double(scatter_ratios[k][0]) * own[0] * (3 + squares) / 24;
        light[1] += double(scatter_ratios[k][1]) * own[1] * crossed / 48;
        light[2] += double(scatter_ratios[k][2]) * own[2] * both / 12;
    }
    return light;
}

} // namespace

namespace {

// Optical depths and opacities of the eight.
struct Depths {
    Depths(const Eight& densities, double extinction)
    {
        for (int k = 0; k < 8; ++k) {
            depths[k] = extinction * densities[k];
            opacity[k] = depths[k] > 0 ? -std::expm1(-depths[k]) : 0;
            sum += opacity[k];
        }
    }
    Eight depths{}, opacity{};
    double sum = 0; // of opacities
};

ScatterRatio ratioOf(const EightVoxels& fine, const Depths& d, double depth, double own_share)
{
    ScatterRatio ratio = kHomogeneous;
    if (!(depth > 0)) return ratio;
    const Axes light = scattered(d.depths, d.opacity, fine);
    const ScatterRatio even = homogeneous(depth, -std::expm1(-depth), own_share);
    for (int i = 0; i < 3; ++i)
        if (even[i] > 1e-6f * float(d.sum)) ratio[i] = float(light[i] / double(even[i]));
    return ratio;
}

} // namespace

CoarserVoxel coarserVoxel(const EightVoxels& fine, double own_share, double extinction)
{
    double mean = 0;
    for (const double density : fine.densities) mean += density / 8;
    if (!(extinction > 0) || !(mean > 0)) return {mean, kHomogeneous};
    const Depths d(fine.densities, extinction);
    const double total = depthOfColumns(d.depths, d.opacity);
    return {total / (6 * extinction), ratioOf(fine, d, total / 3, own_share)};
}

ScatterRatio scatterRatioOf(const EightVoxels& fine, double density, double own_share,
                            double extinction)
{
    return ratioOf(fine, Depths(fine.densities, extinction), 2 * extinction * density, own_share);
}

} // namespace volcomp
