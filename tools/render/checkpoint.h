// A render that was stopped, in a file beside its picture.
#pragma once

#include <filesystem>

#include <nlohmann/json.hpp>

#include "volcomp/render/render.h"
#include "volcomp/scene/scene.h"

namespace volcomp {

/// All that a picture depends on: volume, settings, camera, lights, materials and the program's
/// version.
nlohmann::json renderFingerprint(const Scene& scene, const std::filesystem::path& volume);

/// The file appears when it is complete. Throws Error where it cannot be written.
void writeCheckpoint(const std::filesystem::path& file, const nlohmann::json& fingerprint,
                     const RenderState& state);

/// Throws Error where the file is no complete checkpoint, or one of another render: the message
/// says what differs.
RenderState readCheckpoint(const std::filesystem::path& file, const nlohmann::json& fingerprint);

} // namespace volcomp
