// SPDX-License-Identifier: Apache-2.0
// Small helpers for the texts of messages.
#pragma once

#include <string>
#include <vector>

namespace volcomp {

/// Returns the words in their order with `between` between them; an empty text for no words.
std::string joined(const std::vector<std::string>& words, const std::string& between = ", ");

/// Returns the names of things that have a member `name`, in their order.
template <class T>
std::vector<std::string> namesOf(const std::vector<T>& things)
{
    std::vector<std::string> names;
    names.reserve(things.size());
    for (const T& thing : things) names.push_back(thing.name);
    return names;
}

/// Levenshtein's edit distance: the least number of characters (bytes) to insert, remove or
/// replace.
std::size_t editDistance(const std::string& a, const std::string& b);

/// Returns the known word that `word` most likely means: the first one at the least edit distance,
/// or an empty text if that distance is more than half the length of `word` (but at least 2).
std::string nearestSpelling(const std::string& word, const std::vector<std::string>& known);

} // namespace volcomp
