// SPDX-License-Identifier: Apache-2.0
// Settings KEY=VALUE beside a scene file, which count as if the file said them. Private to the
// reader.
//
// A key is dotted, as in TOML. Where the file has an array of tables, its next part is the name of
// one of them, or its number from 1: light.rim.strength, box.fur.level.2.length.
#pragma once

#include <memory>
#include <string>

#include "volcomp/scene/toml_file.h"

namespace volcomp {

/// One setting, as a file of its own with one key.
struct Setting {
    std::shared_ptr<TomlFile> file;
};

/// Throws Error if the text is no KEY=VALUE, or if it sets `include`, which was followed before.
Setting readSetting(const std::string& text);

/// Moves the setting's value into the root table of a file. Throws Error if it goes through an
/// array that has no table of its name.
void applySetting(toml::table& root, Setting& setting);

/// Whether the root has the table TABLE.NAME that the setting's key begins with; for an array, a
/// table of that name.
bool holdsSetting(const toml::table& root, const Setting& setting);

} // namespace volcomp
