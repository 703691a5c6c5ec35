// SPDX-License-Identifier: Apache-2.0
// The reference of the scene file, as the parser itself lists it.
#pragma once

#include <string>
#include <vector>

namespace volcomp {

/// One row: a key, or, if `key` is empty, the heading of a table.
struct KeyDoc {
    std::string table, key, type, fallback, range, unit, meaning;
};

/// Returns the rows as Markdown tables, one for each table of the scene file.
std::string keysAsMarkdown(const std::vector<KeyDoc>& docs);

} // namespace volcomp
