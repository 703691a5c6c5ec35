// SPDX-License-Identifier: Apache-2.0
#include "volcomp/scene/scene_skins.h"

#include <algorithm>

#include "volcomp/base/error.h"

namespace volcomp {

std::unique_ptr<const SkinTracer> loadSkins(const Scene& scene, const Progress& progress)
{
    std::vector<SkinMesh> meshes;
    for (const SurfaceSpec& spec : scene.surfaces) {
        if (spec.skin.material.empty() || spec.skin.as != SkinAs::mesh) continue;
        const auto material =
            std::find_if(scene.materials.begin(), scene.materials.end(),
                         [&](const Material& m) { return m.name == spec.skin.material; });
        if (material == scene.materials.end())
            throw fileError(scene.file, "surface." + spec.name + ".skin",
                            "a [material." + spec.skin.material + "] table", "none");
        auto mesh = std::make_shared<const Mesh>(loadMesh(spec));
        SecondDensity maps = loadSkinMaps(spec, *mesh);
        meshes.push_back(
            {spec.name, std::move(mesh), spec.projection, spec.skin, std::move(maps), *material});
        report(progress, double(meshes.size()) / double(scene.surfaces.size()));
    }
    if (meshes.empty()) return nullptr;
    return std::make_unique<const SkinTracer>(std::move(meshes));
}

} // namespace volcomp
