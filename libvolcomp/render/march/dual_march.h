// SPDX-License-Identifier: Apache-2.0
// The trilinear filter along a ray, cell by cell of a DualTree, in closed form: inside a cell the
// density is cubic along the ray, and two Gauss-Legendre points integrate that exactly (MODEL
// section 3).
#pragma once

#include "volcomp/render/tree/dual_tree.h"
#include "volcomp/render/march/march.h"

namespace volcomp {

constexpr double kGaussPoint = 0.57735026918962576451; ///< the points are + and - this, on [-1, 1]

/// Returns the place of a cell's lowest corner among the densities that were gathered for its
/// block. `cell` is the cell's offset in the block, as VoxelTree::offset().
inline int gatheredOffset(int cell)
{
    return ((cell >> 6) * DualTree::kDim + (cell >> 3 & 7)) * DualTree::kDim + (cell & 7);
}
/// Returns the distance from a cell's lowest corner to corner 4 x + 2 y + z in these densities.
inline int gatheredCorner(int number)
{
    return ((number >> 2) * DualTree::kDim + (number >> 1 & 1)) * DualTree::kDim + (number & 1);
}

/// Finds the voxel whose centre is corner 4 x + 2 y + z of a cell.
inline void cornerVoxel(const int* cell, int corner, int* voxel)
{
    voxel[0] = cell[0] + (corner >> 2);
    voxel[1] = cell[1] + (corner >> 1 & 1);
    voxel[2] = cell[2] + (corner & 1);
}

/// Finds the integrals of a cell's eight trilinear weights along the ray o + t d, over t from t0 to
/// t1. `cell` is the cell's lowest corner.
inline void cornerWeights(const double* o, const double* d, const int* cell, double t0, double t1,
                          double* weights)
{
    const double middle = 0.5 * (t0 + t1), half = 0.5 * (t1 - t0), reach = half * kGaussPoint;
    for (int k = 0; k < 8; ++k) weights[k] = 0;
    for (const double t : {middle - reach, middle + reach}) {
        const double x = o[0] + d[0] * t - cell[0], y = o[1] + d[1] * t - cell[1],
                     z = o[2] + d[2] * t - cell[2];
        const double wx[2] = {half * (1 - x), half * x}, wy[2] = {1 - y, y}, wz[2] = {1 - z, z};
        for (int k = 0; k < 8; ++k) weights[k] += wx[k >> 2] * wy[k >> 1 & 1] * wz[k & 1];
    }
}

/// Returns the density's integral over the ray's way through a block of cells whose lowest is
/// `low`, in density x voxels; `densities` are those gathered for the block.
///
/// The four corners (y,z) = 00, 01, 10, 11 of a cell's faces across x are summed apart: between the
/// two faces the densities are interpolated, and a corner's weight is the product of a linear
/// function of y and one of z. trilinear.cpp does the same with a corner in each lane of a vector.
inline double blockIntegral(const float* densities, const MarchRay& r, const CellWalk<1>& start,
                            const int* low)
{
    const double o[3] = {r.o[0] - low[0], r.o[1] - low[1], r.o[2] - low[2]};
    double sums[4] = {};
    forEachVoxel(r, start, [&](int cell, double t, double end) {
        end = std::max(t, std::min(end, r.t1));
        const double middle = 0.5 * (t + end), half = 0.5 * (end - t), reach = kGaussPoint * half;
        const double x = o[0] - (cell >> 6), y = cell >> 3 & 7, z = cell & 7;
        const float* v = densities + gatheredOffset(cell);
        for (int k = 0; k < 4; ++k) {
            const double below = v[gatheredCorner(k)], step = v[gatheredCorner(4 + k)] - below;
            const double sign_y = k & 2 ? 1 : -1, rest_y = k & 2 ? 0 : 1;
            const double sign_z = k & 1 ? 1 : -1, rest_z = k & 1 ? 0 : 1;
            const double y0 = (sign_y * o[1] + rest_y) - sign_y * y, dy = sign_y * r.d[1];
            const double z0 = (sign_z * o[2] + rest_z) - sign_z * z, dz = sign_z * r.d[2];
            const auto at = [&](double s) {
                return (step * (r.d[0] * s + x) + below) * ((dy * s + y0) * (dz * s + z0));
            };
            sums[k] += half * (at(middle - reach) + at(middle + reach));
        }
    });
    return (sums[0] + sums[1]) + (sums[2] + sums[3]);
}

/// Returns the density's integral along the ray (in the dual tree's coordinates), in density x
/// voxels. As soon as the integral exceeds `stop`, returns what it has.
inline double lineIntegral(const DualTree& dual, const MarchRay& r, double stop)
{
    DualTree::Gathered& gathered = dual.gathered();
    double sum = 0;
    forEachLeaf(dual, r, [&](const LeafSpan& span) {
        sum += blockIntegral(gathered.densities(span.leaf), r, *span.start, span.cell);
        return sum < stop;
    });
    return sum;
}

} // namespace volcomp
