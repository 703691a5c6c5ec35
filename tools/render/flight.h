// SPDX-License-Identifier: Apache-2.0
// A scene seen by one camera after another in one process, which keeps what it has made of the
// voxels from picture to picture.
#pragma once

#include <filesystem>
#include <vector>

#include "tools/shared/rendered_volume.h"
#include "tools/shared/tool.h"
#include "volcomp/render/skin/skin_tracer.h"
#include "volcomp/scene/scene.h"
#include "volcomp/view/camera.h"

namespace volcomp {

/// Reads a camera a line: eye, target and, if it is not the scene's, the field of view in degrees,
/// as numbers with spaces or commas between. Empty lines and what follows a # do not count. The
/// rest is `camera`'s. Throws Error with the line if it is anything else, or if there is none.
std::vector<Camera> readCameras(const std::filesystem::path& file, const Camera& camera);

/// The file of picture `number` of a pattern, whose last run of # stands for it, with zeros before
/// it. Throws Error if there is no #.
std::filesystem::path frameFile(const std::filesystem::path& pattern, int number);

/// Renders the scene by each camera to frameFile(), counted from 1, of each pattern, and adds what
/// each picture took to the statistics.
void renderFlight(Tool& tool, const Scene& scene, const std::vector<Camera>& cameras,
                  const RenderedVolume& volume, const SkinTracer* skins,
                  const std::vector<std::filesystem::path>& patterns);

} // namespace volcomp
