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
#include "volcomp/view/tone.h"
#include "volcomp/scene/key_docs.h"

namespace volcomp {

/// All that a scene file says, in the units of the library: metres, radians, linear RGB. Paths are
/// those of the file with the scene's directory in front; those of a scene that comes through a
/// pipe are left as they are.
struct Scene {
    std::filesystem::path file;
    /// The scene and the scenes that it includes, each once, its own last.
    std::vector<std::filesystem::path> scene_files;
    std::vector<Material> materials;
    std::vector<GrowthRule> boxes; ///< and the scene's own grooms, each behind all boxes
    std::vector<SurfaceSpec> surfaces;
    std::vector<Layer> layers;
    ComposeParams compose;
    Camera camera;
    std::vector<Light> lights;
    RenderParams render;
    Look look; ///< of pictures as PNG
    /// What may be a mistake, one sentence each, with the file and the line; programs print them.
    std::vector<std::string> warnings;
};

/// Reads a scene (TOML) from a file, or from a pipe (/dev/stdin, /dev/fd/N), which is read to its
/// end. Whatever the files hold, this takes seconds: they may have 32 MB and 200,000 tables in all.
/// Throws Error with the file, the line and the value for anything that is
/// not as scenes/README.md says: wrong syntax, unknown and missing keys, wrong types, values out of
/// range and names that nothing has. It opens the scene and the scenes that this includes, but no
/// mesh and no image.
///
/// Each setting KEY=VALUE counts as if the file said it: a dotted key, in which a part after the
/// name of an array is the name or the number (from 1) of one of its tables, such as
/// light.rim.strength=2. A value that is none of TOML's is a word.
Scene readScene(const std::filesystem::path& file, const std::vector<std::string>& settings = {});

/// Returns every file that the scene names, sorted and without repetition: its scene_files, and
/// the meshes and images of its tables. They need not exist.
std::vector<std::filesystem::path> usedFiles(const Scene& scene);

/// Takes a surface and the layers on it out of a scene. Returns false, and leaves the scene as it
/// is, if there is no surface of that name.
[[nodiscard]] bool removeSurface(Scene& scene, const std::string& surface);

/// Every key that readScene() knows, in the order of the documentation.
std::vector<KeyDoc> sceneKeys();

} // namespace volcomp
