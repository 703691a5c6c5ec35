// SPDX-License-Identifier: Apache-2.0
// The file beside a picture that keeps the state of a stopped render.
#pragma once

#include <filesystem>

#include <nlohmann/json.hpp>

#include "volcomp/render/render.h"
#include "volcomp/scene/scene.h"

namespace volcomp {

/// Everything that a picture depends on: volume, settings, camera, lights, materials, skins and the
/// program's version. `volume` says which volume it is, as one of the next two does.
nlohmann::json renderFingerprint(const Scene& scene, const nlohmann::json& volume);

/// Which volume a file holds. Throws Error if it cannot be read.
nlohmann::json fileIdentity(const std::filesystem::path& volume, const std::string& grid = {});

/// Writes the state of a render. The file appears under its name when it is complete. Throws Error
/// if it cannot be written.
void writeCheckpoint(const std::filesystem::path& file, const nlohmann::json& fingerprint,
                     const RenderState& state);

/// Reads the state of the render with this fingerprint. Throws Error if the file is not a complete
/// checkpoint or belongs to another render; the message says what differs.
RenderState readCheckpoint(const std::filesystem::path& file, const nlohmann::json& fingerprint);

} // namespace volcomp
