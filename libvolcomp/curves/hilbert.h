// SPDX-License-Identifier: Apache-2.0
// The order of places along a Hilbert curve: neighbours on it are neighbours in space.
#pragma once

#include <array>
#include <cstdint>

namespace volcomp {

/// Returns how far along the curve the cell lies; its coordinates are below 2^21. From Skilling,
/// Programming the Hilbert curve, 2004, axes to transposed index.
inline std::uint64_t hilbertIndex(std::array<std::uint32_t, 3> x)
{
    constexpr int kBits = 21;
    for (std::uint32_t q = 1U << (kBits - 1); q > 1; q >>= 1)
        for (std::uint32_t& axis : x)
            if (axis & q) x[0] ^= q - 1;
            else {
                const std::uint32_t t = (x[0] ^ axis) & (q - 1);
                x[0] ^= t;
                axis ^= t;
            }
    x[1] ^= x[0];
    x[2] ^= x[1];
    std::uint32_t t = 0;
    for (std::uint32_t q = 1U << (kBits - 1); q > 1; q >>= 1)
        if (x[2] & q) t ^= q - 1;
    std::uint64_t index = 0;
    for (int bit = kBits - 1; bit >= 0; --bit)
        for (const std::uint32_t axis : x) index = index << 1 | ((axis ^ t) >> bit & 1U);
    return index;
}

} // namespace volcomp
