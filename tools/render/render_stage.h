// SPDX-License-Identifier: Apache-2.0
// The stage *render* of the programs: a volume becomes pictures, with previews and a checkpoint on
// the way.
#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include <nlohmann/json.hpp>

#include "tools/shared/rendered_volume.h"
#include "tools/shared/tool.h"
#include "volcomp/render/render.h"
#include "volcomp/render/skin/skin_tracer.h"
#include "volcomp/scene/scene.h"

namespace volcomp {

/// The files of one picture.
struct PictureFiles {
    std::vector<std::filesystem::path> outputs; ///< .exr or .png
    std::filesystem::path preview;              ///< written soon, and after each pass; empty: none
    bool resume = false;                        ///< go on where this render was stopped
    double checkpoint_seconds = 20;             ///< between states that are kept; 0: none are
};

/// The file that keeps the state of a stopped render; no path if there is no picture.
std::filesystem::path checkpointOf(const PictureFiles& files);

/// Whether a render reads or writes the checkpoint.
bool usesCheckpoint(const PictureFiles& files);

/// What a stopped render left, if it is to be gone on with; otherwise the start. Throws Error as
/// readCheckpoint() does.
RenderState startingState(const Tool& tool, const PictureFiles& files,
                          const nlohmann::json& fingerprint);

/// Warns of a scene without any light.
void warnIfDark(const Tool& tool, const Scene& scene);

/// The skins that are meshes; null if there are none.
std::unique_ptr<const SkinTracer> skinStage(Tool& tool, const Scene& scene);

/// Renders a volume whose levels are loaded, from `state` on, and writes the pictures. Says what
/// it did and adds it to the statistics. The first SIGTERM or SIGINT stops it if it has a
/// checkpoint, which is then written. Throws Error if it was stopped, and as render() and
/// writeImage() do.
void renderStage(Tool& tool, const Scene& scene, const RenderedVolume& volume,
                 const SkinTracer* skins, const nlohmann::json& fingerprint, RenderState state,
                 const PictureFiles& files);

} // namespace volcomp
