// SPDX-License-Identifier: Apache-2.0
#include "volcomp/scene/scene_inputs.h"

#include <system_error>

#include "volcomp/curves/curve_set.h"

namespace volcomp {
namespace {

void add(std::vector<NamedFile>& files, const char* key, const std::filesystem::path& file)
{
    if (!file.empty()) files.push_back({key, file});
}

void addMaps(std::vector<NamedFile>& files, const char* key, const std::vector<MapFactor>& maps)
{
    for (const MapFactor& map : maps) add(files, key, map.image);
}

} // namespace

std::vector<NamedFile> inputsOf(const SurfaceSpec& surface)
{
    std::vector<NamedFile> files;
    add(files, "mesh", surface.mesh);
    add(files, "height_map", surface.terrain.height_map);
    addMaps(files, "skin_map", surface.skin.maps);
    return files;
}

std::vector<NamedFile> inputsOf(const Layer& layer)
{
    std::vector<NamedFile> files;
    addMaps(files, "where", layer.where);
    addMaps(files, "size_map", layer.size);
    addMaps(files, "colour", layer.colour);
    addMaps(files, "tilt_map", layer.tilt_map);
    addMaps(files, "comb_degrees_map", layer.comb_angle_map);
    add(files, "comb_map", layer.comb_map);
    add(files, "points", layer.points);
    return files;
}

std::vector<NamedFile> inputsOf(const GrowthRule& rule)
{
    std::vector<NamedFile> files;
    add(files, "mesh", rule.mesh.file);
    for (const auto& file : rule.files) add(files, "files", file);
    for (const MeshMatch& m : rule.mesh.materials) {
        add(files, "texture", m.texture);
        add(files, "alpha", m.alpha);
    }
    if (!rule.curves) return files;
    add(files, "curves", rule.curves->file);
    if (std::error_code code; std::filesystem::exists(sidecarOf(rule.curves->file), code))
        add(files, "curves' sidecar", sidecarOf(rule.curves->file));
    add(files, "colour_map", rule.curves->colour_map);
    return files;
}

std::vector<NamedFile> inputsOf(const Scene& scene)
{
    std::vector<NamedFile> files;
    for (const auto& file : scene.scene_files)
        add(files, file == scene.file ? "the scene" : "an included scene", file);
    const auto addTable = [&](const std::string& table, const std::vector<NamedFile>& inputs) {
        for (const NamedFile& input : inputs) files.push_back({table + input.name, input.file});
    };
    for (const GrowthRule& rule : scene.boxes)
        addTable((rule.curves && rule.curves->groom ? "groom." : "box.") + rule.name + ".",
                 inputsOf(rule));
    for (const SurfaceSpec& s : scene.surfaces) addTable("surface." + s.name + ".", inputsOf(s));
    for (const Layer& l : scene.layers) addTable("layer '" + l.name + "' ", inputsOf(l));
    add(files, "dome.image", scene.render.dome.file);
    return files;
}

} // namespace volcomp
