// SPDX-License-Identifier: Apache-2.0
// What composing checks before it begins.
#pragma once

#include <vector>

#include "volcomp/compose/compose_params.h"
#include "volcomp/place/placed_scene.h"
#include "volcomp/volume/volume.h"

namespace volcomp {

/// Throws Error if a placement or parameter is out of range.
void checkComposeInput(const std::vector<Box>& boxes, const PlacedScene& scene,
                       const ComposeParams& params);

} // namespace volcomp
