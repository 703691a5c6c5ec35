// SPDX-License-Identifier: Apache-2.0
// Random numbers as a function of (seed, index). No state is shared, so neither the number of
// threads nor the order of the calls changes a result.
//
// The generator is SplitMix64 (Steele, Lea, Flood: Fast splittable pseudorandom number generators,
// OOPSLA 2014): the k-th number of a key's stream is the mix of key + k times the golden gamma. The
// distributions are our own, because those of the standard library differ between implementations.
// The same key gives the same numbers on every machine.
#pragma once

#include <cmath>
#include <cstdint>

#include "volcomp/base/portable_math.h"
#include "volcomp/base/vec.h"

namespace volcomp {

/// SplitMix64's finalizer: a bijection of 64 bits whose output looks random.
constexpr std::uint64_t mix64(std::uint64_t x)
{
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
    return x ^ (x >> 31);
}

/// Returns the key of a child stream: hashKey(hashKey(seed, layer), sample) is a separate stream
/// for every (seed, layer, sample).
constexpr std::uint64_t hashKey(std::uint64_t key, std::uint64_t index)
{
    return mix64(mix64(key + 0x9e3779b97f4a7c15ULL)
                 ^ (index * 0xd1342543de82ef95ULL + 0x2545f4914f6cdd1dULL));
}

/// A stream of random numbers that depends on its key alone. A copy continues at the same place in
/// the stream.
class Random {
public:
    explicit constexpr Random(std::uint64_t key) : m_state(key) { }

    constexpr std::uint64_t bits() { return mix64(m_state += 0x9e3779b97f4a7c15ULL); }

    /// Uniform in [0, 1).
    constexpr double uniform() { return static_cast<double>(bits() >> 11) * 0x1.0p-53; }

    /// Uniform in [low, high); `low` if both are equal.
    constexpr double uniform(double low, double high) { return low + (high - low) * uniform(); }

    /// Uniform in [-1, 1).
    constexpr double symmetric() { return 2 * uniform() - 1; }

    /// Standard normal, by Box and Muller's method; uses two numbers of the stream.
    double normal()
    {
        const double radius = std::sqrt(-2 * portable::log(1 - uniform()));
        return radius * portable::cos(2 * kPi * uniform());
    }

private:
    std::uint64_t m_state;
};

} // namespace volcomp
