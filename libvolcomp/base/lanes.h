// As many floats as the target's vectors hold, for the loops in which composing spends its time.
// Arithmetic, comparisons and choices are the compiler's own (GCC and Clang); here is what they
// lack.
#pragma once

#include <cstdint>
#include <cstring>

#ifdef __SSE2__
#include <immintrin.h>
#endif

namespace volcomp {

#if defined(__AVX512F__)
constexpr int kLanes = 16;
#elif defined(__AVX__)
constexpr int kLanes = 8;
#else
constexpr int kLanes = 4;
#endif
using Lanes = float __attribute__((vector_size(4 * kLanes)));
using IntLanes = std::int32_t __attribute__((vector_size(4 * kLanes)));
using Four = float __attribute__((vector_size(16)));

/// Aligned to their size.
inline Lanes& lanesAt(float* p) { return *reinterpret_cast<Lanes*>(p); }
inline const Lanes& lanesAt(const float* p) { return *reinterpret_cast<const Lanes*>(p); }
inline IntLanes& lanesAt(std::int32_t* p) { return *reinterpret_cast<IntLanes*>(p); }

/// From anywhere.
inline Lanes lanesFrom(const float* p)
{
    Lanes v;
    std::memcpy(&v, p, sizeof(v));
    return v;
}

/// The second where the first is no number.
inline Lanes max(Lanes a, float b)
{
#ifdef __AVX512F__ // compilers make two instructions of the choice; and GCC 12 warns where no mask
                   // is given
    return reinterpret_cast<Lanes>(
        _mm512_maskz_max_ps(0xffff, reinterpret_cast<__m512>(a), _mm512_set1_ps(b)));
#else
    return a > b ? a : Lanes{} + b;
#endif
}
inline Lanes min(Lanes a, float b)
{
#ifdef __AVX512F__
    return reinterpret_cast<Lanes>(
        _mm512_maskz_min_ps(0xffff, reinterpret_cast<__m512>(a), _mm512_set1_ps(b)));
#else
    return a < b ? a : Lanes{} + b;
#endif
}

/// Bit i: lane i of a comparison's result is true.
inline unsigned bitsOf(IntLanes truth)
{
#if defined(__AVX512F__)
    const auto v = reinterpret_cast<__m512i>(truth);
    return _mm512_test_epi32_mask(v, v);
#elif defined(__AVX__)
    return static_cast<unsigned>(_mm256_movemask_ps(reinterpret_cast<__m256>(truth)));
#elif defined(__SSE2__)
    return static_cast<unsigned>(_mm_movemask_ps(reinterpret_cast<__m128>(truth)));
#else
    unsigned bits = 0;
    for (int i = 0; i < kLanes; ++i) bits |= unsigned(truth[i] & 1) << i;
    return bits;
#endif
}

/// 1 / sqrt(x) to 7e-7 of itself, for positive normal x: no division, and the same on any machine
/// (constants: Kadlec 2010).
inline Lanes reciprocalRoot(Lanes x)
{
    IntLanes i;
    std::memcpy(&i, &x, sizeof(x));
    i = 0x5f1ffff9 - (i >> 1);
    Lanes y;
    std::memcpy(&y, &i, sizeof(x));
    y *= 0.703952253f * (2.38924456f - x * y * y);
    return y * (1.5f - 0.5f * x * y * y);
}

} // namespace volcomp
