// SPDX-License-Identifier: Apache-2.0
// What is looked at before a file is parsed. Private to the reader.
#pragma once

namespace volcomp {

struct ReadBudget;
struct TomlFile;

/// Throws Error, with the line, if more than 32 brackets are open at a place of the text or a key
/// has more than 32 parts, because what parses a value and what frees it call themselves for each
/// table inside another; if it holds more tables than the budget, from which they are taken; or if
/// a table's header has no name. A text that is no TOML may pass.
void requireFlat(const TomlFile& file, ReadBudget& budget);

} // namespace volcomp
