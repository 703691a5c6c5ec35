// SPDX-License-Identifier: Apache-2.0
#include "tools/shared/scene_files.h"

namespace volcomp {

std::vector<NamedFile> filesOf(const Scene& scene)
{
    std::vector<NamedFile> files;
    for (const auto& file : scene.scene_files)
        files.push_back({file == scene.file ? "the scene" : "an included scene", file});
    if (!scene.render.dome.file.empty()) files.push_back({"dome.image", scene.render.dome.file});
    const auto addMaps = [&](const std::string& key, const std::vector<MapFactor>& maps) {
        for (const MapFactor& map : maps)
            if (!map.image.empty()) files.push_back({key, map.image});
    };
    for (const SurfaceSpec& s : scene.surfaces) {
        const std::string table = "surface." + s.name;
        if (!s.mesh.empty()) files.push_back({table + ".mesh", s.mesh});
        if (!s.terrain.height_map.empty())
            files.push_back({table + ".height_map", s.terrain.height_map});
        addMaps(table + ".skin_map", s.skin.maps);
    }
    for (const Layer& l : scene.layers) {
        const std::string table = "layer '" + l.name + "' ";
        addMaps(table + "where", l.where);
        addMaps(table + "size_map", l.size);
        addMaps(table + "colour", l.colour);
        if (!l.comb_map.empty()) files.push_back({table + "comb_map", l.comb_map});
    }
    return files;
}

} // namespace volcomp
