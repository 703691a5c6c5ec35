// SPDX-License-Identifier: Apache-2.0
// The files that make one scene: the scene's own and those that it includes. Private to the reader.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "volcomp/scene/toml_reader.h"

namespace volcomp {

/// The key that names included files; the same for every file.
extern const Key kIncludeKey;

/// One file, opened. `includes` are places in the list of openSceneFiles(), without repetition and
/// in the order in which the file names them.
struct SceneFile {
    TableReader table;
    std::vector<std::size_t> includes;
};

/// Opens a scene and all that it includes, each file once. A file comes after those that it
/// includes, the scene itself comes last. Throws Error, with the line, if a file does not exist,
/// if files include each other, and if there are more than 10,000 files or 100,000 includes.
///
/// Each setting KEY=VALUE then changes the file whose material, box or light it is about, or else
/// the scene itself. Throws Error as applySetting() does.
std::vector<SceneFile> openSceneFiles(const std::filesystem::path& file,
                                      const std::vector<std::string>& settings = {});

} // namespace volcomp
