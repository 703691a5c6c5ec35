// One scene file, read and checked: what all three programs work from.
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

/// All that a scene file says.
struct Scene {
    std::filesystem::path file;
    std::vector<Material> materials;
    std::vector<GrowthRule> boxes;
    std::vector<SurfaceSpec> surfaces;
    std::vector<Layer> layers;
    ComposeParams compose;
    Camera camera;
    std::vector<Light> lights;
    RenderParams render;
};

/// Reads a scene (TOML). Throws Error with the file, line and value for anything that is not as
/// scenes/README.md says: syntax, unknown and missing keys, wrong types, values out of range, names
/// that nothing has.
Scene readScene(const std::filesystem::path& file);

/// Takes a surface and the layers on it out of a scene. Throws Error where there is no surface of
/// that name.
void removeSurface(Scene& scene, const std::string& surface);

/// Every key that readScene() knows, in the order of the documentation.
std::vector<KeyDoc> sceneKeys();

} // namespace volcomp
