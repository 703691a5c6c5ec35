// SPDX-License-Identifier: Apache-2.0
// The exact way with the trilinear filter: cell by cell between voxel centres, in closed form.
#include <algorithm>
#include <cmath>

#include "volcomp/render/march/dual_march.h"
#include "volcomp/render/march/integration.h"
#include "volcomp/render/march/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "volcomp/render/march/trilinear.cpp"
#include <hwy/foreach_target.h> // NOLINT(misc-header-include-cycle)
#include <hwy/highway.h>

#include "volcomp/render/march/fast_walk-inl.h"

HWY_BEFORE_NAMESPACE();
namespace volcomp::HWY_NAMESPACE {

namespace {

#if HWY_TARGET == HWY_SCALAR || HWY_TARGET == HWY_EMU128
double blockIntegralFast(const float* densities, const MarchRay& r, const CellWalk<1>& start,
                         const int* low)
{
    return blockIntegral(densities, r, start, low);
}
#else

// blockIntegral() in vectors. The lanes are the corners of a cell's face across x, in the order
// (y,z) = 00, 01, 10, 11; between the two faces the densities are interpolated.
#if HWY_MAX_BYTES >= 32
constexpr int kLanes = 4;
#else
constexpr int kLanes = 2;
#endif
constexpr int kParts = 4 / kLanes;
using Tag = hn::FixedTag<double, kLanes>;
using Lanes = hn::Vec<Tag>;

// The densities at the four corners of a face, or at those two that `part` has.
HWY_INLINE Lanes faceDensities(const float* face, int part)
{
    const auto two = [&](int y) {
        return hn::LoadU(hn::FixedTag<float, 2>(), face + y * gatheredCorner(2));
    };
#if HWY_MAX_BYTES >= 32
    (void)part;
    return hn::PromoteTo(Tag(), hn::Combine(hn::FixedTag<float, 4>(), two(1), two(0)));
#else
    return hn::PromoteTo(Tag(), two(part));
#endif
}

// A corner's weight is the product of a linear function of y and one of z: 1 - y at a lower corner,
// y at an upper one. The functions have these signs and constants, and a cell's coordinates (0 to 7
// in its block) take kCellOffsets from them.
struct CellOffsets {
    alignas(32) double y[kLeafDim][4] = {}, z[kLeafDim][4] = {};
    constexpr CellOffsets()
    {
        for (int c = 0; c < kLeafDim; ++c)
            for (int k = 0; k < 4; ++k) {
                y[c][k] = k & 2 ? c : -c;
                z[c][k] = k & 1 ? c : -c;
            }
    }
};
constexpr CellOffsets kCellOffsets;
alignas(32) constexpr double kSignY[4] = {-1, -1, 1, 1}, kRestY[4] = {1, 1, 0, 0},
                             kSignZ[4] = {-1, 1, -1, 1}, kRestZ[4] = {1, 0, 1, 0};

double blockIntegralFast(const float* densities, const MarchRay& r, const CellWalk<1>& start,
                         const int* low)
{
    const Tag d;
    const double o[3] = {r.o[0] - low[0], r.o[1] - low[1], r.o[2] - low[2]}, dx = r.d[0],
                 t_end = r.t1;
    Lanes sums[kParts], oy[kParts], oz[kParts], dy[kParts], dz[kParts];
    for (int part = 0; part < kParts; ++part) {
        const Lanes sign_y = hn::Load(d, kSignY + part * kLanes),
                    sign_z = hn::Load(d, kSignZ + part * kLanes);
        sums[part] = hn::Zero(d);
        oy[part] = hn::Add(hn::Mul(sign_y, hn::Set(d, o[1])), hn::Load(d, kRestY + part * kLanes));
        oz[part] = hn::Add(hn::Mul(sign_z, hn::Set(d, o[2])), hn::Load(d, kRestZ + part * kLanes));
        dy[part] = hn::Mul(sign_y, hn::Set(d, r.d[1]));
        dz[part] = hn::Mul(sign_z, hn::Set(d, r.d[2]));
    }
    FastWalk::forEachVoxel(r, start, [&](int cell, double t, double end) {
        end = std::max(t, std::min(end, t_end));
        const double middle = 0.5 * (t + end), half = 0.5 * (end - t), reach = kGaussPoint * half,
                     x = o[0] - (cell >> 6);
        const float* v = densities + gatheredOffset(cell);
        for (int part = 0; part < kParts; ++part) {
            const Lanes below = faceDensities(v, part),
                        step = hn::Sub(faceDensities(v + gatheredCorner(4), part), below);
            const Lanes y0 = hn::Sub(oy[part],
                                     hn::Load(d, kCellOffsets.y[cell >> 3 & 7] + part * kLanes)),
                        z0 = hn::Sub(oz[part],
                                     hn::Load(d, kCellOffsets.z[cell & 7] + part * kLanes));
            const auto at = [&](double s) {
                const Lanes along = hn::Set(d, s);
                return hn::Mul(hn::Add(hn::Mul(step, hn::Set(d, dx * s + x)), below),
                               hn::Mul(hn::Add(hn::Mul(dy[part], along), y0),
                                       hn::Add(hn::Mul(dz[part], along), z0)));
            };
            sums[part] =
                hn::Add(sums[part],
                        hn::Mul(hn::Set(d, half), hn::Add(at(middle - reach), at(middle + reach))));
        }
    });
    alignas(32) double sum[4];
    for (int part = 0; part < kParts; ++part) hn::Store(sums[part], d, sum + part * kLanes);
    return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}
#endif

// lineIntegral() of dual_march.h, faster.
double lineIntegralFast(const DualTree& dual, const MarchRay& r, double stop)
{
    DualTree::Gathered& gathered = dual.gathered();
    double sum = 0;
    forEachLeaf(dual, r, [&](const LeafSpan& span) {
        sum += blockIntegralFast(gathered.densities(span.leaf), r, *span.start, span.cell);
        return sum < stop;
    });
    return sum;
}

// The densities at a cell's corners; false if all are 0.
bool cornerDensities(const float* gathered, int cell, float* corners)
{
    const float* v = gathered + gatheredOffset(cell);
    float sum = 0;
    for (int k = 0; k < 8; ++k) sum += corners[k] = v[gatheredCorner(k)];
    return sum > 0;
}

double effectiveDensity(const MarchScene& scene, const DualTree::Corner& c, float rho,
                        const Vec3d& d)
{
    return scene.directed && rho > 0 ? rho * scene.tree.directionFactor(c.leaf, c.voxel, d) : rho;
}

// The line integral with directed extinction, whose factor differs from corner to corner.
double directedIntegral(const MarchScene& scene, const MarchRay& r, const Vec3d& d)
{
    const DualTree& dual = *scene.dual;
    DualTree::Gathered& gathered = dual.gathered();
    double sum = 0;
    forEachLeaf(dual, r, [&](const LeafSpan& span) {
        const float* densities = gathered.densities(span.leaf);
        FastWalk::forEachVoxel(r, *span.start, [&](int offset, double t, double end) {
            end = std::min(end, r.t1);
            float rho[8];
            if (!(end > t) || !cornerDensities(densities, offset, rho)) return;
            const int cell[3] = {span.cell[0] + (offset >> 6), span.cell[1] + (offset >> 3 & 7),
                                 span.cell[2] + (offset & 7)};
            double weights[8];
            cornerWeights(r.o, r.d, cell, t, end, weights);
            for (int k = 0; k < 8; ++k)
                if (rho[k] > 0)
                    sum += weights[k]
                        * effectiveDensity(scene, dual.corner(span.leaf, offset, k), rho[k], d);
        });
        return sum < scene.stop;
    });
    return sum;
}

// The piece of a ray in one cell of a leaf, and the optical depth that each corner adds.
struct CellPiece {
    int leaf, offset; ///< of the cell in the dual tree
    int cell[3];
    double t, end;
    double depths[8];
    double densities[8]; ///< of the corners, as the ray sees them
};

// Finds RaySegment::profile: the cubic polynomial through four densities along the ray. `delta` is
// the piece's optical depth.
void findProfile(const MarchScene& scene, const MarchRay& r, const CellPiece& piece, double delta,
                 double* profile)
{
    double rho[4];
    for (int i = 0; i < 4; ++i) {
        const Vec3d p = r.at(piece.t + (piece.end - piece.t) * (i / 3.0));
        const double x = p[0] - piece.cell[0], y = p[1] - piece.cell[1], z = p[2] - piece.cell[2];
        rho[i] = 0;
        for (int k = 0; k < 8; ++k)
            rho[i] += piece.densities[k] * (k >> 2 ? x : 1 - x) * (k >> 1 & 1 ? y : 1 - y)
                * (k & 1 ? z : 1 - z);
    }
    const double scale = scene.extinction * (piece.end - piece.t) / delta;
    profile[0] = scale * rho[0];
    profile[1] = scale * (-5.5 * rho[0] + 9 * rho[1] - 4.5 * rho[2] + rho[3]);
    profile[2] = scale * (9 * rho[0] - 22.5 * rho[1] + 18 * rho[2] - 4.5 * rho[3]);
    profile[3] = scale * 4.5 * (-rho[0] + 3 * rho[1] - 3 * rho[2] + rho[3]);
}

// Adds the segment. Each centre's particles are shaded with that centre's direction and colour; the
// cell shows their mean, weighted by the optical depth that each adds (exact, since the density is
// cubic along the ray).
void addCell(const MarchScene& scene, const MarchRay& r, const Vec3d& direction,
             const CellPiece& piece, double delta, RaySample& sample, RayScratch& scratch)
{
    const Vec3d half(0.5), middle = r.at(0.5 * (piece.t + piece.end)) + half;
    scratch.shading.start(scene.lights.size());
    for (int k = 0; k < 8; ++k) {
        if (!(piece.depths[k] > 0)) continue;
        const DualTree::Corner c = scene.dual->corner(piece.leaf, piece.offset, k);
        SeenVoxel seen{c.leaf, c.voxel, {}, piece.depths[k] / delta};
        cornerVoxel(piece.cell, k, seen.cell);
        shadeVoxel(scene, seen, middle, -direction, scratch.shading);
    }
    RaySegment segment{
        delta,
        piece.t,
        piece.end,
        r.at(piece.t) + half,
        r.at(piece.end) + half,
        {int(std::floor(middle[0])), int(std::floor(middle[1])), int(std::floor(middle[2]))}};
    if (scene.params.shadows != Shadows::none) findProfile(scene, r, piece, delta, segment.profile);
    addSegment(scene, segment, sample, scratch);
}

HWY_FLATTEN double depth(const MarchScene& scene, const MarchRay& r, const Vec3d& direction)
{
    return scene.extinction
        * (scene.directed ? directedIntegral(scene, r, direction)
                          : lineIntegralFast(*scene.dual, r, scene.stop));
}

HWY_FLATTEN void trace(const MarchScene& scene, const MarchRay& r, const Vec3d& direction,
                       RaySample& sample, RayScratch& scratch)
{
    const DualTree& dual = *scene.dual;
    DualTree::Gathered& gathered = dual.gathered();
    forEachLeaf(dual, r, [&](const LeafSpan& span) {
        const LeafWay way(r, *span.start, FastWalk());
        for (int i = 0; i < way.count; ++i) {
            const int offset = way.voxels[i];
            CellPiece piece{span.leaf,
                            offset,
                            {span.cell[0] + (offset >> 6), span.cell[1] + (offset >> 3 & 7),
                             span.cell[2] + (offset & 7)},
                            way.times[i],
                            std::min(way.times[i + 1], r.t1),
                            {},
                            {}};
            float rho[8];
            // Rays to lights gather, too: the place may hold another block by now.
            if (!(piece.end > piece.t)
                || !cornerDensities(gathered.densities(span.leaf), offset, rho))
                continue;
            cornerWeights(r.o, r.d, piece.cell, piece.t, piece.end, piece.depths);
            double delta = 0;
            for (int k = 0; k < 8; ++k) {
                piece.densities[k] =
                    effectiveDensity(scene, dual.corner(span.leaf, offset, k), rho[k], direction);
                piece.depths[k] *= scene.extinction * piece.densities[k];
                delta += piece.depths[k];
            }
            if (!(delta > 0)) continue;
            addCell(scene, r, direction, piece, delta, sample, scratch);
            if (sample.transmittance < scene.params.cutoff) return false;
        }
        return true;
    });
}

} // namespace
} // namespace volcomp::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace volcomp {
namespace {

HWY_EXPORT(depth);
HWY_EXPORT(trace);

} // namespace

double trilinearDepth(const MarchScene& scene, const MarchRay& r, const Vec3d& direction)
{
    return HWY_DYNAMIC_DISPATCH(depth)(scene, r, direction);
}

void traceTrilinear(const MarchScene& scene, const MarchRay& r, const Vec3d& direction,
                    RaySample& sample, RayScratch& scratch)
{
    HWY_DYNAMIC_DISPATCH(trace)(scene, r, direction, sample, scratch);
}

} // namespace volcomp
#endif
