// The trilinear filter along a ray, cell by cell of a DualTree, in closed form: inside a cell the
// density is cubic along the ray, and two Gauss-Legendre points integrate that exactly (MODEL
// section 3).
#pragma once

#include "volcomp/render/tree/dual_tree.h"
#include "volcomp/render/march/march.h"

namespace volcomp {

constexpr double kGaussPoint = 0.57735026918962576451; ///< of two, on [-1, 1]

/// Of a cell (an offset as VoxelTree::offset()), in the densities that were gathered for its block.
inline int gatheredOffset(int cell)
{
    return ((cell >> 6) * DualTree::kDim + (cell >> 3 & 7)) * DualTree::kDim + (cell & 7);
}
/// From a cell to its corner 4 x + 2 y + z.
inline int gatheredCorner(int number)
{
    return ((number >> 2) * DualTree::kDim + (number >> 1 & 1)) * DualTree::kDim + (number & 1);
}

/// The voxel whose centre is corner 4 x + 2 y + z of a cell.
inline void cornerVoxel(const int* cell, int corner, int* voxel)
{
    voxel[0] = cell[0] + (corner >> 2);
    voxel[1] = cell[1] + (corner >> 1 & 1);
    voxel[2] = cell[2] + (corner & 1);
}

/// The integrals over t from t0 to t1 of the eight trilinear weights along the ray o + t d, from
/// the cell's lowest corner.
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

/// The density's integral over the ray's way through a block of cells whose lowest is `low`, in
/// density x voxels. No branch but the loop's.
inline double blockIntegral(const float* densities, const MarchRay& r, const CellWalk<1>& start,
                            const int* low)
{
#if defined(__AVX2__) && defined(__FMA__) && defined(__BMI2__)
    // Lanes: corners (y,z) = 00, 01, 10, 11. Along x the corners are interpolated, along y and z
    // weighted.
    const __m256d ay = _mm256_set_pd(0, 0, 1, 1), sy = _mm256_set_pd(1, 1, -1, -1),
                  az = _mm256_set_pd(0, 1, 0, 1), sz = _mm256_set_pd(1, -1, 1, -1);
    const __m256d d = _mm256_set_pd(0, r.d[2], r.d[1], r.d[0]),
                  o = _mm256_set_pd(0, r.o[2] - low[2], r.o[1] - low[1], r.o[0] - low[0]);
    __m256d sum = _mm256_setzero_pd();
    forEachVoxel(r, start, [&](int cell, double t, double end) {
        end = std::max(t, std::min(end, r.t1));
        const double middle = 0.5 * (t + end), half = 0.5 * (end - t), reach = kGaussPoint * half;
        const __m256d origin =
            _mm256_sub_pd(o, _mm256_set_pd(0, cell & 7, cell >> 3 & 7, cell >> 6));
        const float* v = densities + gatheredOffset(cell);
        const auto four =
            [](const float* y0,
               const float* y1) { // two from each; floats need not be aligned as a double is
                return _mm256_cvtps_pd(
                    _mm_loadh_pi(_mm_castsi128_ps(_mm_loadu_si64(y0)), (const __m64*)y1));
            };
        const __m256d x0 = four(v, v + gatheredCorner(2)),
                      dx = _mm256_sub_pd(four(v + gatheredCorner(4), v + gatheredCorner(6)), x0);
        const auto at = [&](double s) {
            const __m256d p = _mm256_fmadd_pd(d, _mm256_set1_pd(s), origin);
            const __m256d y = _mm256_fmadd_pd(sy, _mm256_permute4x64_pd(p, 0x55), ay),
                          z = _mm256_fmadd_pd(sz, _mm256_permute4x64_pd(p, 0xAA), az);
            return _mm256_mul_pd(_mm256_fmadd_pd(dx, _mm256_permute4x64_pd(p, 0), x0),
                                 _mm256_mul_pd(y, z));
        };
        sum = _mm256_fmadd_pd(_mm256_set1_pd(half),
                              _mm256_add_pd(at(middle - reach), at(middle + reach)), sum);
    });
    alignas(32) double parts[4];
    _mm256_store_pd(parts, sum);
    return (parts[0] + parts[1]) + (parts[2] + parts[3]);
#else
    double sum = 0;
    forEachVoxel(r, start, [&](int cell, double t, double end) {
        end = std::max(t, std::min(end, r.t1));
        const int at[3] = {low[0] + (cell >> 6), low[1] + (cell >> 3 & 7), low[2] + (cell & 7)};
        const float* v = densities + gatheredOffset(cell);
        double weights[8];
        cornerWeights(r.o, r.d, at, t, end, weights);
        for (int k = 0; k < 8; ++k) sum += weights[k] * v[gatheredCorner(k)];
    });
    return sum;
#endif
}

/// The density's integral along the ray (in the dual tree's coordinates). Stops, with what it has,
/// where it exceeds `stop`.
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
