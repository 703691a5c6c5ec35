// SPDX-License-Identifier: Apache-2.0
// The skins of a scene file that are meshes, ready for render().
#pragma once

#include <memory>

#include "volcomp/base/progress.h"
#include "volcomp/render/skin/skin_tracer.h"
#include "volcomp/scene/scene.h"

namespace volcomp {

/// Loads the surfaces whose skins are meshes, with their maps; null if there are none. Throws Error
/// as loadMesh(), loadSkinMaps() and SkinTracer() do.
std::unique_ptr<const SkinTracer> loadSkins(const Scene& scene, const Progress& progress = {});

} // namespace volcomp
