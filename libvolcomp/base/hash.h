// SPDX-License-Identifier: Apache-2.0
// A hash of bytes that is the same on every machine and in every version, so that files and random
// streams may depend on it. It is not safe against inputs made to collide.
#pragma once

#include <cstdint>
#include <string_view>

namespace volcomp {

/// FNV-1a, 64 bits (Fowler, Noll, Vo; RFC 9923). To go on with a further text, give the hash so far
/// as `hash`: fnv1a(b, fnv1a(a)) is fnv1a(ab).
constexpr std::uint64_t fnv1a(std::string_view bytes, std::uint64_t hash = 0xcbf29ce484222325ULL)
{
    for (const char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3ULL;
    return hash;
}

} // namespace volcomp
