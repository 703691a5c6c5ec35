// SPDX-License-Identifier: Apache-2.0
// The walk through a leaf in vectors, compiled for each instruction set (Highway's
// foreach_target.h).
//
// A source that includes this calls the templates of march.h with FastWalk from functions that are
// HWY_FLATTEN: what these call is then compiled for their instruction set, too. The results are
// those of PlainWalk, bit by bit.
#if defined(VOLCOMP_RENDER_MARCH_FAST_WALK_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef VOLCOMP_RENDER_MARCH_FAST_WALK_INL_H_
#undef VOLCOMP_RENDER_MARCH_FAST_WALK_INL_H_
#else
#define VOLCOMP_RENDER_MARCH_FAST_WALK_INL_H_
#endif

#include <hwy/highway.h>

#include "volcomp/render/march/march.h"

HWY_BEFORE_NAMESPACE();
namespace volcomp::HWY_NAMESPACE {

#if HWY_TARGET == HWY_SCALAR || HWY_TARGET == HWY_EMU128
using FastWalk = PlainWalk;
#else

namespace hn = hwy::HWY_NAMESPACE;

/// See PlainWalk.
struct FastWalk {
    template <class F>
    static void forEachVoxel(const MarchRay& r, const CellWalk<1>& start, F&& f)
    {
        using Pair = hn::FixedTag<double, 2>;
        const Pair pair;
        const auto two = [&](double x, double y) {
            return hn::OddEven(hn::Set(pair, y), hn::Set(pair, x));
        };
        double t = start.t;
        unsigned place = leafPlace(r, start);
        std::uint8_t crossed[8];
#if HWY_MAX_BYTES >= 32
        const hn::FixedTag<double, 4> d; // x, y, z, z
        auto next = hn::Combine(d, hn::Set(pair, start.next[2]), two(start.next[0], start.next[1]));
        const auto delta =
            hn::Combine(d, hn::Set(pair, start.delta[2]), two(start.delta[0], start.delta[1]));
        do {
            const auto either = hn::Min(next, hn::Shuffle01(next)),
                       least = hn::Min(either, hn::SwapAdjacentBlocks(either));
            const double end = hn::GetLane(least);
            f(int(place & LeafPlace::kOffset), t, end);
            t = end;
            const auto crosses = hn::Le(next, least);
            hn::StoreMaskBits(d, crosses, crossed);
            place += r.step[crossed[0] & 7];
            next = hn::Add(next, hn::IfThenElseZero(crosses, delta));
        } while (!(place & LeafPlace::kLeft));
#else
        auto next_xy = two(start.next[0], start.next[1]), next_z = hn::Set(pair, start.next[2]);
        const auto delta_xy = two(start.delta[0], start.delta[1]),
                   delta_z = hn::Set(pair, start.delta[2]);
        do {
            const auto least = hn::Min(hn::Min(next_xy, hn::Shuffle01(next_xy)), next_z);
            const double end = hn::GetLane(least);
            f(int(place & LeafPlace::kOffset), t, end);
            t = end;
            const auto crosses_xy = hn::Le(next_xy, least), crosses_z = hn::Le(next_z, least);
            hn::StoreMaskBits(pair, crosses_xy, crossed);
            hn::StoreMaskBits(pair, crosses_z, crossed + 1);
            place += r.step[(crossed[0] & 3) | (crossed[1] & 1) << 2];
            next_xy = hn::Add(next_xy, hn::IfThenElseZero(crosses_xy, delta_xy));
            next_z = hn::Add(next_z, hn::IfThenElseZero(crosses_z, delta_z));
        } while (!(place & LeafPlace::kLeft));
#endif
    }
};
#endif

} // namespace volcomp::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif // the guard of this target
