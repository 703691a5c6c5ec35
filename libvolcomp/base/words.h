// SPDX-License-Identifier: Apache-2.0
// The words of an enumeration. One table serves the scene file, the options of the programs and the
// files that they write.
#pragma once

#include <cstddef>
#include <utility>

namespace volcomp {

template <class E>
using Word = std::pair<const char*, E>;

/// Returns the word of a value. The value must be in the table.
template <class E, std::size_t N>
const char* wordOf(const Word<E> (&words)[N], E value)
{
    std::size_t i = 0;
    while (i + 1 < N && words[i].second != value) ++i;
    return words[i].first;
}

} // namespace volcomp
