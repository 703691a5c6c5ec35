// SPDX-License-Identifier: Apache-2.0
// What was measured is kept in files whose names follow from all that it depends on.
#pragma once

#include <filesystem>
#include <string>

#include <nlohmann/json.hpp>

#include "volcomp/scene/scene.h"

namespace volcomp {

/// Returns a hash of the bytes of a file; that of no bytes if it cannot be read.
std::string contentHash(const std::filesystem::path& file);

/// Returns a hash of the scene's file and of every file that it names and that exists.
std::string contentHash(const Scene& scene);

/// Returns DIRECTORY/KIND_HASH.ENDING, where the hash is that of the key.
std::filesystem::path keptFile(const std::filesystem::path& directory, const std::string& kind,
                               const nlohmann::json& key, const std::string& ending);

/// Writes a value for readKept(). The file appears when it is complete.
void keep(const std::filesystem::path& file, const nlohmann::json& value);

/// Returns what was kept in a file; null if there is none or it is damaged.
nlohmann::json readKept(const std::filesystem::path& file);

} // namespace volcomp
