// SPDX-License-Identifier: Apache-2.0
#include "volcomp/compose/tile_kernels.h"

#include <cstddef>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "volcomp/compose/tile_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

// Compiled once for each instruction set. Nothing here may instantiate a template of a header: the
// linker could take this copy, with its instructions, for all of the program. Sums are written as
// products and sums, never as fused ones, so that the bytes do not depend on the machine.
HWY_BEFORE_NAMESPACE();
namespace volcomp {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using Floats = hn::CappedTag<float, 16>;
using Ints = hn::RebindToSigned<Floats>;
using Vec = hn::Vec<Floats>;
using IntVec = hn::Vec<Ints>;
constexpr int kLanes = hn::MaxLanes(Floats());
constexpr int kAcross = TileCells::kAcross, kRow = TileChannels::kRow;
constexpr int kBatch = CubeBatch::kSize;
constexpr int kEntries = sizeof(VoxelSum) / sizeof(float);

HWY_INLINE Vec set(float x) { return hn::Set(Floats(), x); }
HWY_INLINE Vec load(const float* p) { return hn::Load(Floats(), p); }
HWY_INLINE void store(Vec v, float* p) { hn::Store(v, Floats(), p); }

/// Where each cube of a batch starts, and how much of it each cell has.
struct Shares {
    HWY_ALIGN std::int32_t row[kBatch]; ///< of its first cell
    HWY_ALIGN std::int32_t z[kBatch];
    HWY_ALIGN std::int32_t touched[4][kBatch]; ///< bits for its first two rows in x and in y
    HWY_ALIGN float third[kBatch];       ///< > 0 if it reaches into a third cell along an axis
    HWY_ALIGN float along[3][3][kBatch]; ///< by axis and cell
    HWY_ALIGN float part[8][kBatch];     ///< of the first two cells along each axis, z fastest
};

/// Fills `s` for the cubes from k on, as many as a vector has lanes.
HWY_INLINE void findShares(const CubeBatch& batch, int k, float width, Shares& s)
{
    const Floats f;
    const Ints i32;
    const Vec one = set(1), zero = set(0), whole = set(width);
    IntVec cell[3];
    Vec w[3][3];
    for (int i = 0; i < 3; ++i) {
        const Vec p = load(&batch.low[i][k]) + set(TileCells::kMargin); // > 0
        cell[i] = hn::ConvertTo(i32, p);
        w[i][0] = hn::Min(one - (p - hn::ConvertTo(f, cell[i])), whole);
        w[i][1] = hn::Min(whole - w[i][0], one);
        w[i][2] = hn::Max(whole - w[i][0] - w[i][1], zero);
        for (int c = 0; c < 3; ++c) store(w[i][c], &s.along[i][c][k]);
    }
    hn::Store(cell[0] * hn::Set(i32, kAcross) + cell[1], i32, &s.row[k]);
    hn::Store(cell[2], i32, &s.z[k]);
    store(hn::Max(hn::Max(w[0][2], w[1][2]), w[2][2]), &s.third[k]);
    const auto two_x = hn::RebindMask(i32, w[0][1] > zero),
               two_y = hn::RebindMask(i32, w[1][1] > zero),
               two_z = hn::RebindMask(i32, w[2][1] > zero);
    // Lanes behind the batch's end hold anything, and to shift by more than 31 is undefined.
    const IntVec low_bits = hn::And(cell[2], hn::Set(i32, 31)),
                 bits = hn::IfThenElse(two_z, hn::Set(i32, 3), hn::Set(i32, 1)) << low_bits,
                 bits_y = hn::IfThenElseZero(two_y, bits);
    hn::Store(bits, i32, &s.touched[0][k]);
    hn::Store(bits_y, i32, &s.touched[1][k]);
    hn::Store(hn::IfThenElseZero(two_x, bits), i32, &s.touched[2][k]);
    hn::Store(hn::IfThenElseZero(two_x, bits_y), i32, &s.touched[3][k]);
    for (int c = 0; c < 4; ++c) {
        const Vec xy = w[0][c >> 1] * w[1][c & 1];
        store(xy * w[2][0], &s.part[2 * c][k]);
        store(xy * w[2][1], &s.part[2 * c + 1][k]);
    }
}

/// to += f * from
HWY_INLINE void addScaled(VoxelSum& to, const VoxelSum& from, float f)
{
    for (int i = 0; i < kEntries; i += kLanes)
        store(load(to.values + i) + set(f) * load(from.values + i), to.values + i);
}

HWY_INLINE void clear(VoxelSum& cell)
{
    for (int i = 0; i < kEntries; i += kLanes) store(set(0), cell.values + i);
}

/// Adds cube k, which reaches into at most two cells along each axis.
HWY_INLINE void addNarrow(const VoxelSum& sum, const Shares& s, int k, const TileCells& cells)
{
    std::int32_t* const marks = cells.touched + s.row[k];
    marks[0] |= s.touched[0][k];
    marks[1] |= s.touched[1][k];
    marks[kAcross] |= s.touched[2][k];
    marks[kAcross + 1] |= s.touched[3][k];
    VoxelSum* const to = cells.sums + (s.row[k] * kAcross + s.z[k]);
    for (int c = 0; c < 8; ++c)
        addScaled(to[((c >> 2) * kAcross + (c >> 1 & 1)) * kAcross + (c & 1)], sum, s.part[c][k]);
}

/// Adds cube k, which reaches into a third cell along an axis.
void addWide(const VoxelSum& sum, const Shares& s, int k, const TileCells& cells)
{
    const bool three[3] = {s.along[0][2][k] > 0, s.along[1][2][k] > 0, s.along[2][2][k] > 0};
    const std::int32_t touched = (1 | (s.along[2][1][k] > 0 ? 2 : 0) | (three[2] ? 4 : 0))
        << s.z[k];
    for (int x = 0; x < 2 + three[0]; ++x)
        for (int y = 0; y < 2 + three[1]; ++y) {
            const float f = s.along[0][x][k] * s.along[1][y][k];
            const int row = s.row[k] + x * kAcross + y;
            cells.touched[row] |= f > 0 ? touched : 0;
            VoxelSum* const to = cells.sums + (row * kAcross + s.z[k]);
            for (int z = 0; z < 2 + three[2]; ++z) addScaled(to[z], sum, f * s.along[2][z][k]);
        }
}

void addCubes(const CubeBatch& batch, int count, float width, const TileCells& cells)
{
    Shares s;
    for (int k = 0; k < count; k += kLanes) findShares(batch, k, width, s);
    for (int k = 0; k < count; ++k)
        if (s.third[k] > 0) addWide(batch.sum[k], s, k, cells);
        else addNarrow(batch.sum[k], s, k, cells);
}

/// Writes the four floats at `from` of each of four cells as four values of each channel.
HWY_INLINE void transpose(const VoxelSum* const (&cell)[4], int from, float* const (&to)[4])
{
#if HWY_TARGET == HWY_SCALAR
    for (int i = 0; i < 4; ++i)
        for (int c = 0; c < 4; ++c) to[c][i] = cell[i]->values[from + c];
#else
    const hn::FixedTag<float, 4> f;
    const hn::FixedTag<double, 2> pairs;
    const auto a = hn::Load(f, cell[0]->values + from), b = hn::Load(f, cell[1]->values + from),
               c = hn::Load(f, cell[2]->values + from), d = hn::Load(f, cell[3]->values + from);
    const auto ab = hn::BitCast(pairs, hn::InterleaveLower(f, a, b)),
               cd = hn::BitCast(pairs, hn::InterleaveLower(f, c, d)),
               ab_upper = hn::BitCast(pairs, hn::InterleaveUpper(f, a, b)),
               cd_upper = hn::BitCast(pairs, hn::InterleaveUpper(f, c, d));
    hn::Store(hn::BitCast(f, hn::InterleaveLower(pairs, ab, cd)), f, to[0]);
    hn::Store(hn::BitCast(f, hn::InterleaveUpper(pairs, ab, cd)), f, to[1]);
    hn::Store(hn::BitCast(f, hn::InterleaveLower(pairs, ab_upper, cd_upper)), f, to[2]);
    hn::Store(hn::BitCast(f, hn::InterleaveUpper(pairs, ab_upper, cd_upper)), f, to[3]);
#endif
}

void gatherCells(int count, const TileCells& cells, bool scatter_ratio, TileChannels& c)
{
    const int padded = (count + 15) / 16 * 16;
    for (int k = count; k < padded; ++k) c.cell[k] = TileCells::kCount;
    HWY_ALIGN float padding[4];
    for (int k = 0; k < padded; k += 4) {
        VoxelSum* s[4];
        for (int i = 0; i < 4; ++i) s[i] = cells.sums + c.cell[k + i];
        const VoxelSum* const from[4] = {s[0], s[1], s[2], s[3]};
        transpose(from, VoxelSum::kDiagonal,
                  {&c.tensor[0][k], &c.tensor[1][k], &c.tensor[2][k], &c.squares[k]});
        transpose(from, VoxelSum::kMixed,
                  {&c.tensor[3][k], &c.tensor[4][k], &c.tensor[5][k], padding});
        transpose(from, VoxelSum::kColour,
                  {&c.colour[0][k], &c.colour[1][k], &c.colour[2][k], &c.density[k]});
        if (scatter_ratio)
            transpose(
                from, VoxelSum::kScatter,
                {&c.scatter_ratio[0][k], &c.scatter_ratio[1][k], &c.scatter_ratio[2][k], padding});
        for (int i = 0; i < 4 && k + i < count; ++i) clear(*s[i]);
    }
}

/// 1 / sqrt(x) to 7e-7 of itself, for positive normal x, without a division. A first guess from the
/// bits of x and a step of Newton's method with changed constants (Kadlec, Improving the fast
/// inverse square root, 2010), then a plain step.
HWY_INLINE Vec reciprocalRoot(Vec x)
{
    const Floats f;
    const Ints i32;
    const IntVec guess = hn::Set(i32, 0x5f1ffff9) - hn::ShiftRight<1>(hn::BitCast(i32, x));
    Vec y = hn::BitCast(f, guess);
    y = y * (set(0.703952253f) * (set(2.38924456f) - x * y * y));
    return y * (set(1.5f) - set(0.5f) * x * y * y);
}

/// Symmetric tensors of trace 1, one for each lane, with the coefficients of their characteristic
/// polynomial l^3 - l^2 + c1 l - c0.
struct Tensors {
    Vec xx, yy, zz, xy, yz, xz, c1, c0;
};

HWY_INLINE Tensors loadTensors(const float (&t)[6][kRow], int i)
{
    const Vec scale = set(1) / (load(&t[0][i]) + load(&t[1][i]) + load(&t[2][i]));
    Tensors s;
    s.xx = load(&t[0][i]) * scale, s.yy = load(&t[1][i]) * scale, s.zz = load(&t[2][i]) * scale;
    s.xy = load(&t[3][i]) * scale, s.yz = load(&t[4][i]) * scale, s.xz = load(&t[5][i]) * scale;
    s.c1 = (s.xx * s.yy - s.xy * s.xy) + (s.xx * s.zz - s.xz * s.xz) + (s.yy * s.zz - s.yz * s.yz);
    s.c0 = s.xx * (s.yy * s.zz - s.yz * s.yz) - s.xy * (s.xy * s.zz - s.yz * s.xz)
        + s.xz * (s.xy * s.yz - s.yy * s.xz);
    return s;
}

/// 1 - l for the largest eigenvalue l: the sum of the two others, from 0 to 2/3. The closed form
/// l = 1/3 + 2 p cos(acos(r) / 3) (Smith, Eigenvalues of a symmetric 3x3 matrix, CACM 1961), then a
/// step of Newton's method, which makes the error of the cosine (8.4e-6) unimportant.
HWY_INLINE Vec restOfTrace(const Tensors& t)
{
    const Vec p2 = hn::Max(set(1.0f / 9) - t.c1 * set(1.0f / 3), set(1e-12f)),
              p_root = reciprocalRoot(p2), p = p2 * p_root;
    const Vec r =
        (set(1.0f / 27) - t.c1 * set(1.0f / 6) + t.c0 * set(0.5f)) * (p_root * p_root * p_root);
    // With c = cos(acos(r) / 2) = sqrt((1 + r) / 2), the cosine wanted is cos(2/3 acos(c)). The
    // polynomial is the one of degree 4 with the least greatest error for c from 0 to 1 (Remez).
    const Vec c2 = hn::Max(hn::Min(set(0.5f) + set(0.5f) * r, set(1)), set(1e-12f)),
              c = c2 * reciprocalRoot(c2);
    const Vec cosine = set(0.500008325f)
        + c
            * (set(0.576882895f)
               + c * (set(-0.106839202f) + c * (set(0.0388983945f) - c * set(0.00895873849f))));
    Vec m = set(2.0f / 3) - set(2) * p * cosine;
    const Vec l = set(1) - m, slope = l * l - set(2) * m * l + t.c1,
              slope_root = reciprocalRoot(hn::Max(slope, set(1e-6f)));
    m = m - (m * l * l - t.c1 * l + t.c0) * (slope_root * slope_root);
    return hn::Min(hn::Max(m, set(0)), set(0.66f));
}

struct Vectors {
    Vec x, y, z, square; ///< and the square of the length
};

HWY_INLINE Vectors cross(Vec ax, Vec ay, Vec az, Vec bx, Vec by, Vec bz)
{
    Vectors v;
    v.x = ay * bz - az * by, v.y = az * bx - ax * bz, v.z = ax * by - ay * bx;
    v.square = v.x * v.x + v.y * v.y + v.z * v.z;
    return v;
}

HWY_INLINE Vectors longer(const Vectors& a, const Vectors& b)
{
    const auto use_b = b.square > a.square;
    Vectors v;
    v.x = hn::IfThenElse(use_b, b.x, a.x), v.y = hn::IfThenElse(use_b, b.y, a.y);
    v.z = hn::IfThenElse(use_b, b.z, a.z), v.square = hn::IfThenElse(use_b, b.square, a.square);
    return v;
}

/// A vector along the eigenvector of eigenvalue l: the longest of the cross products of two rows of
/// the tensor less l.
HWY_INLINE Vectors eigenvector(const Tensors& t, Vec l)
{
    const Vec a = t.xx - l, b = t.yy - l, c = t.zz - l;
    return longer(longer(cross(a, t.xy, t.xz, t.xy, b, t.yz), cross(a, t.xy, t.xz, t.xz, t.yz, c)),
                  cross(t.xy, b, t.yz, t.xz, t.yz, c));
}

int findDirections(int count, TileChannels& c)
{
    const Floats f;
    const Ints i32;
    int unsure = 0; // the padding is not among them: gatherCells() fills it with a sure tensor
    for (int i = 0; i < count; i += kLanes) {
        const Tensors t = loadTensors(c.tensor, i);
        const Vec m = restOfTrace(t), l = set(1) - m;
        const Vectors v = eigenvector(t, l);
        const Vec spread = m * reciprocalRoot(hn::Max(set(2) * l * m, set(1e-30f))); // sqrt(m / 2l)
        const Vec scale =
            (set(1) - hn::Min(spread, set(1))) * reciprocalRoot(hn::Max(v.square, set(1e-30f)));
        store(scale * v.x, &c.direction[0][i]);
        store(scale * v.y, &c.direction[1][i]);
        store(scale * v.z, &c.direction[2][i]);
        // The polynomial's slope at the root is (l - l2)(l - l3), which is small if the largest
        // eigenvalue is not alone. A NaN is unsure too.
        const auto sure = l * l - set(2) * m * l + t.c1 > set(0.004f);
        if (hn::AllTrue(f, sure)) continue;
        const auto others = hn::RebindMask(i32, hn::Not(sure));
        const IntVec index = hn::Iota(i32, 0) + hn::Set(i32, i);
        hn::StoreU(hn::Compress(index, others), i32, c.unsure + unsure);
        unsure += static_cast<int>(hn::CountTrue(i32, others));
    }
    return unsure;
}

void divideByDensity(int count, const TileChannels& c, float (&values)[3][kRow])
{
    for (int k = 0; k < count; k += kLanes) {
        const Vec f = set(1) / load(&c.density[k]);
        for (int i = 0; i < 3; ++i) store(load(&values[i][k]) * f, &values[i][k]);
    }
}

} // namespace
} // namespace HWY_NAMESPACE
} // namespace volcomp
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace volcomp {

HWY_EXPORT(addCubes);
HWY_EXPORT(gatherCells);
HWY_EXPORT(findDirections);
HWY_EXPORT(divideByDensity);

void addCubes(const CubeBatch& batch, int count, float width, const TileCells& cells)
{
    HWY_DYNAMIC_DISPATCH(addCubes)(batch, count, width, cells);
}

void gatherCells(int count, const TileCells& cells, bool scatter_ratio, TileChannels& c)
{
    HWY_DYNAMIC_DISPATCH(gatherCells)(count, cells, scatter_ratio, c);
}

int findDirections(int count, TileChannels& c)
{
    return HWY_DYNAMIC_DISPATCH(findDirections)(count, c);
}

void divideByDensity(int count, const TileChannels& c, float (&values)[3][TileChannels::kRow])
{
    HWY_DYNAMIC_DISPATCH(divideByDensity)(count, c, values);
}

} // namespace volcomp
#endif
