// SPDX-License-Identifier: Apache-2.0
#include "volcomp/volume/half_floats.h"

#include <cstdint>
#include <cstring>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "volcomp/volume/half_floats.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

// Compiled once for each instruction set. Nothing here may instantiate a template of a header: the
// linker could take this copy, with its instructions, for all of the program.
HWY_BEFORE_NAMESPACE();
namespace volcomp {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using Floats = hn::CappedTag<float, 16>;
using Ints = hn::RebindToSigned<Floats>;
using Halves = hn::Rebind<std::uint16_t, Floats>;

/// The bits of half floats.
HWY_INLINE hn::Vec<Halves> halfBits(hn::Vec<Floats> v)
{
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX2 // has an instruction for it
    return hn::BitCast(Halves(), hn::DemoteTo(hn::Rebind<hwy::float16_t, Floats>(), v));
#else // Highway 1.0.3 does not round here, so this does
    const Floats f;
    const Ints i;
    const auto bits = hn::BitCast(i, v);
    const auto magnitude = bits & hn::Set(i, 0x7fffffff);
    const auto sign = hn::ShiftRight<16>(bits) & hn::Set(i, 0x8000);
    // Adding just under half of the last place carries into it, or just half if it is odd.
    const auto last = hn::ShiftRight<13>(magnitude);
    const auto rounded = hn::ShiftRight<13>(magnitude + hn::Set(i, 0xfff) + (last & hn::Set(i, 1)));
    const auto normal = rounded - hn::Set(i, (127 - 15) << 10);
    // Below 2^-14 a half float counts in 2^-24, which is the last place of floats from 0.5 to 1.
    const auto with_half = hn::BitCast(f, magnitude) + hn::Set(f, 0.5f);
    const auto small = hn::BitCast(i, with_half) - hn::Set(i, 0x3f000000);
    const auto nan = hn::Set(i, 0x7e00) | (last & hn::Set(i, 0x3ff));
    auto result = hn::IfThenElse(magnitude < hn::Set(i, 0x38800000), small, normal);
    result = hn::IfThenElse(magnitude > hn::Set(i, 0x477fefff), hn::Set(i, 0x7c00), result);
    result = hn::IfThenElse(magnitude > hn::Set(i, 0x7f800000), nan, result);
    return hn::DemoteTo(Halves(), result | sign);
#endif
}

/// `to` is room for as many as a vector has.
HWY_INLINE void convert(const float* from, std::uint16_t* to)
{
    hn::StoreU(halfBits(hn::LoadU(Floats(), from)), Halves(), to);
}

HWY_INLINE void convert3(const float* x, const float* y, const float* z, std::uint16_t* to)
{
    const Floats f;
    hn::StoreInterleaved3(halfBits(hn::LoadU(f, x)), halfBits(hn::LoadU(f, y)),
                          halfBits(hn::LoadU(f, z)), Halves(), to);
}

void toHalf(const float* from, std::uint16_t* to, std::size_t count)
{
    constexpr std::size_t n = hn::MaxLanes(Floats());
    std::size_t i = 0;
    for (; i + n <= count; i += n) convert(from + i, to + i);
    if (i == count) return;
    float rest[n] = {};
    std::uint16_t converted[n];
    std::memcpy(rest, from + i, (count - i) * sizeof(float));
    convert(rest, converted);
    std::memcpy(to + i, converted, (count - i) * sizeof(std::uint16_t));
}

void toHalf3(const float* x, const float* y, const float* z, std::uint16_t* to, std::size_t count)
{
    constexpr std::size_t n = hn::MaxLanes(Floats());
    std::size_t i = 0;
    for (; i + n <= count; i += n) convert3(x + i, y + i, z + i, to + 3 * i);
    if (i == count) return;
    float rest[3][n] = {};
    std::uint16_t converted[3 * n];
    const std::size_t bytes = (count - i) * sizeof(float);
    std::memcpy(rest[0], x + i, bytes);
    std::memcpy(rest[1], y + i, bytes);
    std::memcpy(rest[2], z + i, bytes);
    convert3(rest[0], rest[1], rest[2], converted);
    std::memcpy(to + 3 * i, converted, 3 * (count - i) * sizeof(std::uint16_t));
}

} // namespace
} // namespace HWY_NAMESPACE
} // namespace volcomp
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace volcomp {

HWY_EXPORT(toHalf);
HWY_EXPORT(toHalf3);

static_assert(sizeof(Half3) == 6 && sizeof(openvdb::math::half) == 2);

void toHalf(const float* from, openvdb::math::half* to, std::size_t count)
{
    HWY_DYNAMIC_DISPATCH(toHalf)(from, reinterpret_cast<std::uint16_t*>(to), count);
}

void toHalf3(const float* x, const float* y, const float* z, Half3* to, std::size_t count)
{
    HWY_DYNAMIC_DISPATCH(toHalf3)(x, y, z, reinterpret_cast<std::uint16_t*>(to), count);
}

} // namespace volcomp
#endif
