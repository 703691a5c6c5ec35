// SPDX-License-Identifier: Apache-2.0
// The keys of a scene file as a JSON Schema, for editors and checkers of TOML.
#pragma once

#include <string>
#include <vector>

#include "volcomp/scene/key_docs.h"

namespace volcomp {

/// Returns a JSON Schema (draft 7) of a scene file with these keys: types, ranges, words, defaults
/// and meanings, and no other keys. Levels and presets need no key, because one may come from the
/// other.
std::string keysAsSchema(const std::vector<KeyDoc>& docs);

} // namespace volcomp
