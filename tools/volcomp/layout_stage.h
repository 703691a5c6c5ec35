// SPDX-License-Identifier: Apache-2.0
// The layout of a scene as a picture file.
#pragma once

#include <filesystem>
#include <string>

#include "tools/shared/tool.h"
#include "volcomp/scene/scene.h"
#include "volcomp/view/camera.h"

namespace volcomp {

/// Reads EYE,TARGET[,FOV], which are three and three numbers and at most degrees, with commas or
/// spaces between. The rest is `camera`'s. Throws Error "--camera: ..." for anything else.
Camera readCamera(const std::string& text, const Camera& camera);

/// Draws the layout to DIRECTORY/NAME.layout.png, and if layers have maps these as they fall on
/// their surfaces to NAME.maps.png.
void layoutStage(Tool& tool, const Scene& scene, const std::filesystem::path& directory);

} // namespace volcomp
