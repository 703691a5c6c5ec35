// SPDX-License-Identifier: Apache-2.0
// The settings of a render in the words of the scene file, for statistics and metadata and to find
// out whether two renders are the same.
#pragma once

#include <nlohmann/json.hpp>

#include "volcomp/render/render_params.h"
#include "volcomp/view/camera.h"
#include "volcomp/view/light.h"
#include "volcomp/view/tone.h"
#include "volcomp/volume/material.h"

namespace volcomp {

nlohmann::json settingsOf(const RenderParams& params);
nlohmann::json settingsOf(const Camera& camera);
nlohmann::json settingsOf(const Light& light); ///< with its name
/// What the renderer has of a material, with its name.
nlohmann::json settingsOf(const Material& material);
nlohmann::json lookOf(const Look& look);

} // namespace volcomp
