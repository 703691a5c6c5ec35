// SPDX-License-Identifier: Apache-2.0
// The stage *place* of the programs that place a scene's boxes.
#pragma once

#include "tools/shared/tool.h"
#include "volcomp/scene/place_scene.h"
#include "volcomp/scene/scene.h"

namespace volcomp {

/// Places the scene's boxes as a stage of the program, says what it has found and adds it to the
/// statistics. Throws Error as place() does.
PlacedScene placeStage(Tool& tool, const Scene& scene, const PlaceOptions& options = {});

} // namespace volcomp
