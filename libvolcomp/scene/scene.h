// SPDX-License-Identifier: Apache-2.0
// One scene file, read and checked: what the programs work from.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "volcomp/view/camera.h"
#include "volcomp/compose/compose_params.h"
#include "volcomp/place/layer.h"
#include "volcomp/view/light.h"
#include "volcomp/volume/material.h"
#include "volcomp/grow/growth_rule.h"
#include "volcomp/render/render_params.h"
#include "volcomp/surface/surface.h"
#include "volcomp/scene/key_docs.h"

namespace volcomp {

/// All that a scene file says, in the units of the library: metres, radians, linear RGB. Paths are
/// those of the file with the scene's directory in front.
struct Scene {
    std::filesystem::path file;
    /// The scenes that it includes, and those that these include.
    std::vector<std::filesystem::path> included;
    std::vector<Material> materials;
    std::vector<GrowthRule> boxes;
    std::vector<SurfaceSpec> surfaces;
    std::vector<Layer> layers;
    ComposeParams compose;
    Camera camera;
    std::vector<Light> lights;
    RenderParams render;
};

/// Reads a scene (TOML). Throws Error with the file, the line and the value for anything that is
/// not as scenes/README.md says: wrong syntax, unknown and missing keys, wrong types, values out of
/// range and names that nothing has. It opens the scene and the scenes that this includes, but no
/// mesh and no image.
Scene readScene(const std::filesystem::path& file);

/// Takes a surface and the layers on it out of a scene. Returns false, and leaves the scene as it
/// is, if there is no surface of that name.
[[nodiscard]] bool removeSurface(Scene& scene, const std::string& surface);

/// Every key that readScene() knows, in the order of the documentation.
std::vector<KeyDoc> sceneKeys();

} // namespace volcomp
