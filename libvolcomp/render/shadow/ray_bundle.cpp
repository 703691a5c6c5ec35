// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/shadow/ray_bundle.h"

#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "volcomp/render/shadow/ray_bundle.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace volcomp::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

constexpr int kSide = RayBundle::kSide;

constexpr hn::CappedTag<float, kSide> df;
constexpr hn::CappedTag<double, kSide> dd;
constexpr hn::RebindToSigned<decltype(df)> di;
using Floats = hn::Vec<decltype(df)>;
using Ints = hn::Vec<decltype(di)>;

/// Where 16 rays cross the next border of voxels along one axis, in one slice.
struct Crossings {
    alignas(64) float way[kSide]; ///< travel to the border; the slice's if it is not reached
    alignas(64) std::int32_t before[kSide], behind[kSide]; ///< the voxels on both sides of it
};

/// Fills `to` for a slice through which the rays travel `way`, and moves the rays to its end.
/// `inverse` holds the slopes' reciprocals without sign, or a large number for a slope of 0.
HWY_ATTR inline void cross(double* at, const double* slope, const double* inverse, double way,
                           Crossings& to)
{
    const hn::Rebind<float, decltype(dd)> to_float;
    const hn::Rebind<std::int32_t, decltype(dd)> to_int;
    const auto zero = hn::Zero(dd), one = hn::Set(dd, 1.0), slice = hn::Set(dd, way);
    for (std::size_t i = 0; i < kSide; i += hn::Lanes(dd)) {
        const auto x = hn::Load(dd, at + i), s = hn::Load(dd, slope + i), voxel = hn::Floor(x);
        const auto down = hn::Lt(s, zero);
        const auto inside = hn::Sub(x, voxel);
        const auto to_border =
            hn::Mul(hn::IfThenElse(down, inside, hn::Sub(one, inside)), hn::Load(dd, inverse + i));
        hn::Store(hn::DemoteTo(to_float, hn::Min(to_border, slice)), to_float, to.way + i);
        hn::Store(hn::DemoteTo(to_int, voxel), to_int, to.before + i);
        const auto next = hn::IfThenElse(down, hn::Sub(voxel, one), hn::Add(voxel, one));
        hn::Store(hn::DemoteTo(to_int, next), to_int, to.behind + i);
        hn::Store(hn::Add(x, hn::Mul(s, slice)), dd, at + i);
    }
}

/// The row's densities at `index`, one for each of some neighbouring rays. They see less than 8 or
/// 16 voxels, beginning at `first`, so that a vector that wide holds all that are asked for.
HWY_ATTR inline Floats lookUp(const float* row, int first, Ints index)
{
    if constexpr (hn::MaxLanes(df) >= 8) {
        const auto from_first = hn::Sub(index, hn::Set(di, first));
        return hn::TableLookupLanes(hn::LoadU(df, row + first), hn::IndicesFromVec(df, from_first));
    } else return hn::GatherIndex(df, row, index);
}

/// Adds what the rays meet in one slice. Each crosses three voxels at most: its borders along b and
/// along c come in either order.
HWY_ATTR inline void addSlice(const float* slice, int row_stride, float way, const Crossings& b,
                              const Crossings& c, float* sums)
{
    const auto end = hn::Set(df, way);
    for (std::size_t j = 0; j < kSide; j += hn::Lanes(df)) {
        const int first = c.before[j] - 1;
        const auto before = hn::Load(di, c.before + j), behind = hn::Load(di, c.behind + j);
        const auto way_c = hn::Load(df, c.way + j);
        for (int i = 0; i < kSide; ++i) {
            const float *here = slice + b.before[i] * row_stride,
                        *there = slice + b.behind[i] * row_stride;
            const auto way_b = hn::Set(df, b.way[i]);
            const auto t1 = hn::Min(way_b, way_c), t2 = hn::Max(way_b, way_c);
            const auto second = hn::IfThenElse(hn::Lt(way_b, way_c), lookUp(there, first, before),
                                               lookUp(here, first, behind));
            float* sum = sums + i * kSide + j;
            const auto with_first =
                hn::Add(hn::Load(df, sum), hn::Mul(t1, lookUp(here, first, before)));
            const auto with_second = hn::Add(with_first, hn::Mul(hn::Sub(t2, t1), second));
            hn::Store(hn::Add(with_second, hn::Mul(hn::Sub(end, t2), lookUp(there, first, behind))),
                      df, sum);
        }
    }
}

HWY_ATTR float push(const Strip& strip, int slices, double first_way, RayBundle& rays,
                    RaySums& sums)
{
    constexpr double kStraight = 1e-12, kNever = 1e30;
    alignas(64) double b_inverse[kSide], c_inverse[kSide];
    for (int i = 0; i < kSide; ++i) {
        const auto invert = [](double& slope) {
            if (std::abs(slope) < kStraight) slope = 0;
            return slope == 0 ? kNever : 1 / std::abs(slope);
        };
        b_inverse[i] = invert(rays.b_slope[i]);
        c_inverse[i] = invert(rays.c_slope[i]);
    }
    for (int n = 0; n < slices; ++n) {
        const double way = n == 0 ? first_way : 1;
        Crossings b, c;
        cross(rays.b, rays.b_slope, b_inverse, way, b);
        cross(rays.c, rays.c_slope, c_inverse, way, c);
        addSlice(strip.first_slice + n * strip.slice_stride, strip.row_stride,
                 static_cast<float>(way), b, c, sums.values);
    }
    auto least = hn::Load(df, sums.values);
    for (std::size_t i = 0; i < RayBundle::kRays; i += hn::Lanes(df))
        least = hn::Min(least, hn::Load(df, sums.values + i));
    return hn::GetLane(hn::MinOfLanes(df, least));
}

/// 255 e^(-x/2) for x >= 0, to a tenth of a unit: 2^y with a polynomial between whole y.
HWY_ATTR inline Floats rootCode(Floats x)
{
    const auto number = [](float value) { return hn::Set(df, value); };
    const auto y = hn::Max(hn::Mul(x, number(-0.72134752f)), number(-60.0f));
    const auto whole = hn::Sub(hn::ConvertTo(di, y), hn::Set(di, 1)); // at or below floor(y)
    const auto f = hn::Sub(y, hn::ConvertTo(df, whole));              // 0 to 2
    auto p = number(0.00133336f);
    for (const float factor : {0.00961813f, 0.0555041f, 0.240227f, 0.69315f, 1.0f})
        p = hn::Add(number(factor), hn::Mul(f, p));
    const auto power = hn::BitCast(df, hn::ShiftLeft<23>(hn::Add(whole, hn::Set(di, 127))));
    return hn::Mul(hn::Mul(number(255), p), power);
}

HWY_ATTR void encode(const RayBundle& rays, const RaySums& sums, double extinction, int stride,
                     std::uint8_t* codes)
{
    const hn::Rebind<std::uint8_t, decltype(df)> to_code;
    alignas(64) float c_squared[kSide];
    for (int j = 0; j < kSide; ++j)
        c_squared[j] = static_cast<float>(rays.c_slope[j] * rays.c_slope[j]);
    const auto per_length = hn::Set(df, static_cast<float>(extinction));
    for (int i = 0; i < kSide; i += stride) {
        const auto b_squared =
            hn::Set(df, static_cast<float>(1 + rays.b_slope[i] * rays.b_slope[i]));
        alignas(64) std::uint8_t row[kSide];
        for (std::size_t j = 0; j < kSide; j += hn::Lanes(df)) {
            const auto length = hn::Sqrt(hn::Add(b_squared, hn::Load(df, c_squared + j)));
            const auto depth =
                hn::Mul(hn::Load(df, sums.values + i * kSide + j), hn::Mul(per_length, length));
            const auto code = hn::ConvertTo(di, hn::Add(rootCode(depth), hn::Set(df, 0.5f)));
            hn::Store(hn::DemoteTo(to_code, code), to_code, row + j);
        }
        for (int j = 0; j < kSide; j += stride) *codes++ = row[j];
    }
}

} // namespace
} // namespace volcomp::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace volcomp {

HWY_EXPORT(push);
HWY_EXPORT(encode);

float pushRays(const Strip& strip, int slices, double first_way, RayBundle& rays, RaySums& sums)
{
    return HWY_DYNAMIC_DISPATCH(push)(strip, slices, first_way, rays, sums);
}

void encodeTransmittances(const RayBundle& rays, const RaySums& sums, double extinction, int stride,
                          std::uint8_t* codes)
{
    HWY_DYNAMIC_DISPATCH(encode)(rays, sums, extinction, stride, codes);
}

} // namespace volcomp
#endif
