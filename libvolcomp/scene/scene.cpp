// SPDX-License-Identifier: Apache-2.0
#include "volcomp/scene/scene.h"

#include <algorithm>
#include <filesystem>

#include "volcomp/scene/known.h"
#include "volcomp/scene/readers.h"
#include "volcomp/scene/scene_files.h"
#include "volcomp/scene/scene_inputs.h"

namespace volcomp {
namespace {

/// A [preset.NAME] table. Nothing is read of it until a level uses it.
struct Preset {
    std::string name;
    std::shared_ptr<const TableReader> table;
};

/// What a scene file gives to those that include it.
struct Shared {
    Known<Preset> presets;
    Known<Material> materials;
    Known<GrowthRule> boxes;
    std::vector<GrowthRule> grooms; ///< the file's own, for nobody else
    Known<Light> lights;
};

/// How many materials, boxes, presets and lights all files of a scene may take over from others,
/// each counted once for each file that takes it: no more than seconds of work.
constexpr std::size_t kMostTaken = 5'000'000;

/// Throws the Error that points at the key of `table` if the list has no such name.
template <class T>
void requireName(const TableReader& table, const char* key, const std::string& what,
                 const Known<T>& list, const std::string& name)
{
    if (list.find(name)) return;
    table.require(false, key, "the name of a " + what + " (" + list.names() + ")");
}

/// The file's own materials, then those of the included files whose names are not there yet.
Known<Material> readMaterials(TableReader& r, const std::vector<const Shared*>& included)
{
    Known<Material> materials;
    for (auto& [name, table] :
         r.named({"material", "", "What voxels are made of: docs/MODEL.md, 4 and 5"}))
        materials.add(readMaterial(table, name));
    for (const Shared* other : included)
        for (const auto& material : other->materials.all()) materials.add(material);
    return materials;
}

/// The file's own presets, then those of the included files whose names are not there yet.
Known<Preset> readPresets(TableReader& r, const std::vector<const Shared*>& included)
{
    Known<Preset> presets;
    for (auto& [name, table] :
         r.named({"preset", "",
                  "Keys of [[box.NAME.level]], for levels that name it with 'use'; their own win"}))
        presets.add({name, std::make_shared<const TableReader>(std::move(table))});
    for (const Shared* other : included)
        for (const auto& preset : other->presets.all()) presets.add(preset);
    return presets;
}

/// The boxes of the included files, but for those that the file has itself, then its own.
Known<GrowthRule> readBoxes(TableReader& r, const std::vector<const Shared*>& included,
                            const Known<Material>& materials, const Known<Preset>& presets,
                            std::vector<std::string>& warnings)
{
    Presets usable;
    usable.reserve(presets.all().size());
    for (const auto& preset : presets.all()) usable.emplace_back(preset->name, preset->table.get());
    Known<GrowthRule> own, boxes;
    for (auto& [name, table] :
         r.named({"box", "", "A kind of volume box, grown by a recursive function"}))
        own.add(readGrowthRule(table, name, materials, usable, warnings));
    for (const Shared* other : included)
        for (const auto& box : other->boxes.all())
            if (!own.find(box->name)) boxes.add(box);
    for (const auto& box : own.all()) boxes.add(box);
    return boxes;
}

/// The file's grooms. They are not shared with files that include this one, as layers are not.
std::vector<GrowthRule> readGrooms(TableReader& r, const Known<GrowthRule>& boxes,
                                   const Known<Material>& materials)
{
    std::vector<GrowthRule> grooms;
    for (auto& [name, table] :
         r.named({"groom", "", "Strands of a file, which stand where the file says"})) {
        table.require(!boxes.find(name), "curves", "a groom whose name no box has");
        grooms.push_back(readGroom(table, name, materials));
    }
    return grooms;
}

Known<SurfaceSpec> readSurfaces(TableReader& r, const Known<Material>& materials,
                                std::vector<std::string>& warnings)
{
    Known<SurfaceSpec> surfaces;
    for (auto& [name, table] : r.named({"surface", "", "A surface that boxes stand on"})) {
        SurfaceSpec surface = readSurface(table, name, warnings);
        if (const std::string& skin = surface.skin.material; !skin.empty()) {
            requireName(table, "skin", "material", materials, skin);
            if (const Material* material = materials.find(skin))
                table.require(material->kind == MaterialKind::surface, "skin",
                              "a material of kind surface");
        }
        surfaces.add(std::move(surface));
    }
    return surfaces;
}

Known<Layer> readLayers(TableReader& r, const Known<GrowthRule>& boxes,
                        const Known<SurfaceSpec>& surfaces)
{
    Known<Layer> layers;
    int index = 0;
    for (auto& table :
         r.tables({"layer", "", "One kind of box over one surface, with its second densities"})) {
        Layer layer = readLayer(table, index++);
        if (layer.surface.empty() && surfaces.all().size() == 1)
            layer.surface = surfaces.all()[0]->name;
        requireName(table, "box", "box", boxes, layer.box);
        requireName(table, "surface", "surface", surfaces, layer.surface);
        for (const Avoid& avoid : layer.avoid) {
            if (!avoid.layer.empty())
                requireName(table, "avoid", "layer above this one", layers, avoid.layer);
            else requireName(table, "avoid", "surface", surfaces, avoid.surface);
            table.require(avoid.surface != layer.surface, "avoid",
                          "a surface other than the layer's own");
        }
        table.require(layers.add(std::move(layer)), "name", "a name that no other layer has");
    }
    index = 0;
    for (auto& table : r.tables({"place", "", "One box at exactly this place"})) {
        Layer layer = readPlace(table, index++);
        if (layer.surface.empty() && surfaces.all().size() == 1)
            layer.surface = surfaces.all()[0]->name;
        requireName(table, "box", "box", boxes, layer.box);
        requireName(table, "surface", "surface", surfaces, layer.surface);
        if (const GrowthRule* rule = boxes.find(layer.box))
            table.require(layer.places[0].variant < rule->variants, "variant",
                          "one of the box's variants");
        table.require(layers.add(std::move(layer)), "name", "a name that no other layer has");
    }
    return layers;
}

/// The file's own lights, then those of the included files whose names are not there yet.
Known<Light> readLights(TableReader& r, const std::vector<const Shared*>& included)
{
    Known<Light> lights;
    int index = 0;
    for (auto& table : r.tables({"light", "", "A light; any number of them"}))
        table.require(lights.add(readLight(table, index++)), "name",
                      "a name that no other light has");
    for (const Shared* other : included)
        for (const auto& light : other->lights.all()) lights.add(light);
    return lights;
}

template <class T>
std::vector<T> copied(const Known<T>& list)
{
    std::vector<T> result;
    result.reserve(list.all().size());
    for (const auto& thing : list.all()) result.push_back(*thing);
    return result;
}

/// Warns of haze that never ends: it hides all of the dome, which someone wanted to be seen.
void warnOfHaze(const TableReader& r, const RenderParams& render,
                std::vector<std::string>& warnings)
{
    if (render.haze.none() || render.haze.height > 0 || render.dome.black() || !render.dome.visible)
        return;
    warnings.push_back(r.place()
                       + ": without a height haze never ends and hides the whole dome behind it. "
                         "Give it one, such as height = 30, or set visible = false in [dome].");
}

/// Lets tables of an included file give what the file leaves out. A dome is of one kind, so it
/// comes whole or not at all.
void shareTables(TableReader& r, const TableReader& included)
{
    for (const char* key : {"camera", "compose", "render", "haze", "picture"})
        r.share(included, key);
    r.share(included, "dome", true);
}

/// Reads one file, all but its materials and boxes into `s`, whose warnings grow.
Shared read(TableReader& r, const std::vector<const Shared*>& included, Scene& s)
{
    Shared shared;
    s.file = r.file();
    r.paths(kIncludeKey, {}); // openSceneFiles() has followed them
    shared.materials = readMaterials(r, included);
    shared.presets = readPresets(r, included);
    shared.boxes = readBoxes(r, included, shared.materials, shared.presets, s.warnings);
    shared.grooms = readGrooms(r, shared.boxes, shared.materials);
    const Known<SurfaceSpec> surfaces = readSurfaces(r, shared.materials, s.warnings);
    s.surfaces = copied(surfaces);
    s.layers = copied(readLayers(r, shared.boxes, surfaces));
    TableReader compose = r.table({"compose", "", "How the placed boxes become one volume"});
    s.compose = readCompose(compose);
    TableReader camera = r.table({"camera", "", "Where the picture is taken from"});
    s.camera = readCamera(camera);
    shared.lights = readLights(r, included);
    s.lights = copied(shared.lights);
    TableReader render = r.table({"render", "", "The picture and how it is computed"});
    s.render = readRender(render);
    TableReader dome = r.table(
        {"dome", "", "The sky: light from all directions, and what is seen behind everything"});
    s.render.dome = readDome(dome);
    TableReader haze =
        r.table({"haze", "", "Air that glows and hides what is far away; lights pass it freely"});
    s.render.haze = readHaze(haze);
    warnOfHaze(haze, s.render, s.warnings);
    TableReader picture = r.table(
        {"picture", "", "How PNG and previews show the picture; an EXR has the radiance itself"});
    s.look = readLook(picture);
    r.finish();
    return shared;
}

} // namespace

Scene readScene(const std::filesystem::path& file, const std::vector<std::string>& settings)
{
    std::vector<SceneFile> files = openSceneFiles(file, settings);
    std::vector<Shared> shared(files.size());
    Scene scene;
    std::size_t taken = 0;
    for (std::size_t i = 0; i < files.size(); ++i) {
        std::vector<const Shared*> included;
        for (const std::size_t other : files[i].includes) {
            included.push_back(&shared[other]);
            taken += shared[other].materials.all().size() + shared[other].boxes.all().size()
                + shared[other].lights.all().size() + shared[other].presets.all().size();
            shareTables(files[i].table, files[other].table);
        }
        files[i].table.require(taken <= kMostTaken, "include",
                               "includes that bring fewer materials, boxes, presets and lights");
        shared[i] = read(files[i].table, included, scene);
        scene.scene_files.push_back(files[i].table.file());
    }
    scene.materials = copied(shared.back().materials);
    scene.boxes = copied(shared.back().boxes);
    for (GrowthRule& groom : shared.back().grooms) scene.boxes.push_back(std::move(groom));
    return scene;
}

std::vector<std::filesystem::path> usedFiles(const Scene& scene)
{
    std::vector<std::filesystem::path> files;
    for (const NamedFile& input : inputsOf(scene)) files.push_back(input.file);
    std::sort(files.begin(), files.end());
    files.erase(std::unique(files.begin(), files.end()), files.end());
    return files;
}

bool removeSurface(Scene& scene, const std::string& surface)
{
    if (std::none_of(scene.surfaces.begin(), scene.surfaces.end(),
                     [&](const SurfaceSpec& s) { return s.name == surface; }))
        return false;
    const auto drop = [](auto& list, const auto& which) {
        list.erase(std::remove_if(list.begin(), list.end(), which), list.end());
    };
    drop(scene.surfaces, [&](const SurfaceSpec& s) { return s.name == surface; });
    drop(scene.layers, [&](const Layer& l) { return l.surface == surface; });
    for (Layer& l : scene.layers)
        drop(l.avoid, [&](const Avoid& avoid) { return avoid.surface == surface; });
    return true;
}

std::vector<KeyDoc> sceneKeys()
{
    std::vector<KeyDoc> docs;
    TableReader reader = TableReader::describing(docs);
    Scene scene;
    read(reader, {}, scene);
    return docs;
}

} // namespace volcomp
