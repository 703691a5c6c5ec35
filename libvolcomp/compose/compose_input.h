// SPDX-License-Identifier: Apache-2.0
// What composing checks before it begins.
#pragma once

#include <cstddef>

#include "volcomp/compose/compose_params.h"
#include "volcomp/place/placed_scene.h"

namespace volcomp {

/// Throws Error if a placement or parameter is out of range. `boxes` is their number.
void checkComposeInput(std::size_t boxes, const PlacedScene& scene, const ComposeParams& params);

} // namespace volcomp
