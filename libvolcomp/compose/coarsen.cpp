// SPDX-License-Identifier: Apache-2.0
#include "volcomp/compose/coarsen.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <vector>

#include "volcomp/base/principal_direction.h"

namespace volcomp {
namespace {

/// A voxel of a part and the coarser voxel into which it falls.
struct Fine {
    std::uint64_t key; ///< mortonKey() of the coarser voxel
    std::array<std::int32_t, 3> coarse;
    std::uint32_t voxel;

    bool operator<(const Fine& other) const
    {
        return std::tie(key, coarse, voxel) < std::tie(other.key, other.coarse, other.voxel);
    }
};

/// All voxels of a part, those of one coarser voxel together.
std::vector<Fine> sortedByCoarse(const SourcePart& part)
{
    const auto coarse = [&](float x) {
        return static_cast<std::int32_t>(std::floor(double(x) / 2 + part.shift / 2));
    };
    std::vector<Fine> fine;
    fine.reserve(part.voxels.size());
    for (std::size_t k = 0; k < part.voxels.size(); ++k) {
        const std::array<std::int32_t, 3> c{coarse(part.x[k]), coarse(part.y[k]),
                                            coarse(part.z[k])};
        fine.push_back({mortonKey(c[0], c[1], c[2]), c, static_cast<std::uint32_t>(k)});
    }
    std::sort(fine.begin(), fine.end());
    return fine;
}

/// Whether two voxels of a part are likely to hold the same strand: their directions agree, and it
/// goes from one to the other.
float sameStrand(const SourcePart& part, std::uint32_t i, std::uint32_t j)
{
    constexpr float kApart = 0.85f; // voxels; those of a diagonal strand's stairs are closer
    const Vec3f a(part.voxels[i].direction()), b(part.voxels[j].direction());
    const float ab = a.dot(b), squares = a.lengthSqr() * b.lengthSqr();
    if (!(squares > 0)) return 0;
    const float agree = std::max(0.0f, 2 * ab * ab / squares - 1);
    if (agree == 0) return 0;
    const Vec3f way(part.x[j] - part.x[i], part.y[j] - part.y[i], part.z[j] - part.z[i]);
    const float along = way.dot(a) * way.dot(a) / a.lengthSqr(),
                apart = part.kind == MaterialKind::fibre ? way.lengthSqr() - along : along;
    return apart < kApart * kApart ? agree : 0;
}

/// The sum over strands of the square of their density, added up over the voxels [begin, end).
float squaresOf(const SourcePart& part, const Fine* begin, const Fine* end)
{
    float sum = 0;
    for (const Fine* f = begin; f != end; ++f) {
        const float own = part.squares[f->voxel];
        sum += own;
        for (const Fine* g = begin; g != f; ++g)
            sum +=
                2 * std::sqrt(own * part.squares[g->voxel]) * sameStrand(part, f->voxel, g->voxel);
    }
    return sum;
}

/// Which halves of a coarser voxel a voxel of it lies in, along each axis: 0 or 1.
std::array<int, 3> halvesOf(const SourcePart& part, const Fine& f)
{
    const float place[3] = {part.x[f.voxel], part.y[f.voxel], part.z[f.voxel]};
    std::array<int, 3> upper{};
    for (int a = 0; a < 3; ++a)
        upper[a] = static_cast<int>(std::floor(double(place[a]) + part.shift)) - 2 * f.coarse[a];
    return upper;
}

/// The voxels [begin, end) of one coarser voxel.
EightVoxels eightOf(const SourcePart& part, const Fine* begin, const Fine* end)
{
    EightVoxels eight;
    for (const Fine* f = begin; f != end; ++f) {
        const std::array<int, 3> upper = halvesOf(part, *f);
        const int k = 4 * upper[0] + 2 * upper[1] + upper[2];
        const double density = double(part.voxels[f->voxel].density());
        eight.densities[k] = density;
        if (!part.scatter_ratios.empty()) eight.scatter_ratios[k] = part.scatter_ratios[f->voxel];
        if (!part.squares.empty())
            eight.own_shares[k] =
                part.ownWeight() * double(part.squares[f->voxel]) / (density * density);
    }
    if (part.squares.empty()) return eight;
    for (const Fine* f = begin; f != end; ++f)
        for (const Fine* g = begin; g != f; ++g) {
            const std::array<int, 3> a = halvesOf(part, *f), b = halvesOf(part, *g);
            const int i = 4 * a[0] + 2 * a[1] + a[2], j = 4 * b[0] + 2 * b[1] + b[2],
                      axis = (i ^ j) == 4 ? 0
                : (i ^ j) == 2            ? 1
                : (i ^ j) == 1            ? 2
                                          : -1;
            if (axis < 0) continue;
            eight.same_beside[i][axis] = eight.same_beside[j][axis] =
                std::sqrt(eight.own_shares[i] * eight.own_shares[j])
                * double(sameStrand(part, f->voxel, g->voxel));
        }
    return eight;
}

/// What is left of the density of the voxels [begin, end) in a voxel of twice the edge that lets as
/// much light through as the columns of voxels along each axis, mean over the axes (MODEL section
/// 8), over their mean density.
float keptDensity(const SourcePart& from, const Fine* begin, const Fine* end)
{
    double depths[3][4] = {}; // of the columns along each axis
    for (const Fine* f = begin; f != end; ++f) {
        const std::uint32_t k = f->voxel;
        const std::array<int, 3> upper = halvesOf(from, *f);
        for (int a = 0; a < 3; ++a)
            depths[a][2 * upper[(a + 1) % 3] + upper[(a + 2) % 3]] +=
                from.densityAlong(k, a) * from.voxel;
    }
    double kept = 0, sum = 0;
    for (const auto& columns : depths) {
        const double least = *std::min_element(columns, columns + 4); // e^-least may underflow
        double passes = 0;
        for (const double depth : columns) {
            passes += std::exp(least - depth) / 4;
            sum += depth / 4;
        }
        kept += least - std::log(passes);
    }
    return sum > 0 ? static_cast<float>(kept / sum) : 1;
}

/// Appends the sum of the voxels [begin, end) of `from` as one voxel of twice the edge, at their
/// centre of mass, without a scatter ratio.
void appendSum(const SourcePart& from, const Fine* begin, const Fine* end, bool keep_blocked,
               SourcePart& to)
{
    SourceVoxel sum;
    SymmetricTensor tensor;
    Vec3d moment(0.0);
    for (const Fine* f = begin; f != end; ++f) {
        const std::uint32_t k = f->voxel;
        const SourceVoxel& v = from.voxels[k];
        sum.density() += v.density() / 8;
        moment += Vec3d(from.x[k], from.y[k], from.z[k]) * (v.density() / 16.0);
        tensor.add(1, Vec3d(v.direction()[0], v.direction()[1], v.direction()[2]));
        tensor.xx += v.iso(), tensor.yy += v.iso(), tensor.zz += v.iso();
        for (int c = 0; c < 3; ++c) sum.colour()[c] += v.colour()[c] / 8;
    }
    const Vec3f place(moment / sum.density());
    const float kept = keep_blocked ? keptDensity(from, begin, end) : 1;
    sum.density() *= kept;
    for (int c = 0; c < 3; ++c) sum.colour()[c] *= kept;
    setDirection(sum, Vec3f(principalDirection(tensor).stored()));
    append(to, place, sum);
    if (!from.squares.empty()) to.squares.push_back(kept * kept * squaresOf(from, begin, end) / 64);
}

/// The scatter ratio of a coarser voxel, number k of `to`, that stands for the voxels [begin, end)
/// of `from`. It is over what a voxel of the coarser part scatters, whose own shares count with
/// that part's ownWeight(): leaves that covered several voxels may be specks in twice as wide ones.
ScatterRatio coarserRatio(const SourcePart& from, const Fine* begin, const Fine* end,
                          const SourcePart& to, std::size_t k)
{
    const auto density = double(to.voxels[k].density());
    const double own =
        to.squares.empty() ? 0 : std::min(1.0, double(to.squares[k]) / (density * density));
    return scatterRatioOf(eightOf(from, begin, end), density, to.ownWeight() * own, from.voxel);
}

/// Calls f(begin, end) for the voxels of each coarser voxel.
template <class F>
void forEachCoarse(const std::vector<Fine>& fine, const F& f)
{
    const Fine* const end = fine.data() + fine.size();
    for (const Fine *first = fine.data(), *next; first != end; first = next) {
        next = std::find_if(first, end, [&](const Fine& g) { return g.coarse != first->coarse; });
        f(first, next);
    }
}

} // namespace

double SourcePart::ownWeight() const
{
    if (kind == MaterialKind::fibre) return 1;
    const double sheet = std::clamp(dimension - 1, 0.0, 1.0);
    return sheet * sheet;
}

double SourcePart::densityAlong(std::uint32_t k, int axis) const
{
    const SourceVoxel& v = voxels[k];
    const double rho = double(v.density());
    if (!has_direction) return rho;
    const double iso = double(v.iso()), d = double(v.direction()[axis]),
                 largest = double(Vec3f(v.direction()).lengthSqr()) + iso,
                 spread = std::sqrt(iso / largest), square = std::min(1.0, (d * d + iso) / rho);
    // The means over all directions are 1: exactly without spread and at its greatest, and within
    // 1 % between (render/tree/voxel_record.h has the exact ones).
    return kind == MaterialKind::fibre
        ? rho * 4 / kPi * std::sqrt(1 - square) / (1 + 0.0396 * spread)
        : rho * 2 * std::sqrt(square) / (1 + 0.1547 * spread);
}

double dimensionOf(const SourcePart& part)
{
    double alone = 0, together = 0; // squares
    forEachCoarse(sortedByCoarse(part), [&](const Fine* begin, const Fine* end) {
        for (const Fine* f = begin; f != end; ++f) alone += double(part.squares[f->voxel]);
        together += double(squaresOf(part, begin, end));
    });
    return alone > 0 ? std::clamp(std::log2(together / alone), 0.0, 2.0) : 1;
}

SourcePart coarsen(const SourcePart& part, Kept keep)
{
    SourcePart s;
    s.box = part.box;
    s.material = part.material;
    s.kind = part.kind;
    s.has_direction = part.has_direction;
    s.has_colour = part.has_colour;
    s.colour = part.colour;
    s.voxel = 2 * part.voxel;
    s.shift = part.shift / 2;
    const std::vector<Fine> fine = sortedByCoarse(part);
    std::size_t count = 0;
    forEachCoarse(fine, [&](const Fine*, const Fine*) { ++count; });
    reserve(s, count);
    if (!part.squares.empty()) s.squares.reserve(count);
    forEachCoarse(fine, [&](const Fine* begin, const Fine* end) {
        appendSum(part, begin, end, keep == Kept::blocked_light, s);
    });
    if (!s.squares.empty()) s.dimension = dimensionOf(s);
    if (keep == Kept::blocked_light) {
        s.scatter_ratios.reserve(count);
        forEachCoarse(fine, [&](const Fine* begin, const Fine* end) {
            s.scatter_ratios.push_back(coarserRatio(part, begin, end, s, s.scatter_ratios.size()));
        });
    }
    setBounds(s);
    return s;
}

} // namespace volcomp
