// Enumerations as words: one table serves the scene file, the programs' options and what they
// write.
#pragma once

#include <cstddef>
#include <utility>

namespace volcomp {

template <class E>
using Word = std::pair<const char*, E>;

/// The word of a value, which must be in the table.
template <class E, std::size_t N>
const char* wordOf(const Word<E> (&words)[N], E value)
{
    std::size_t i = 0;
    while (i + 1 < N && words[i].second != value) ++i;
    return words[i].first;
}

} // namespace volcomp
