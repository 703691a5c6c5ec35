// SPDX-License-Identifier: Apache-2.0
#include "volcomp/scene/scene.h"

#include <algorithm>
#include <filesystem>

#include "volcomp/base/error.h"
#include "volcomp/scene/readers.h"

namespace volcomp {
namespace {

template <class T>
bool hasName(const std::vector<T>& list, const std::string& name)
{
    return std::any_of(list.begin(), list.end(), [&](const T& x) { return x.name == name; });
}

template <class T>
std::string namesOf(const std::vector<T>& list)
{
    std::string text;
    for (const T& x : list) text += (text.empty() ? "" : ", ") + x.name;
    return text.empty() ? "there is none" : text;
}

/// Throws the Error that points at the key of `table` if no element of the list has the name.
template <class T>
void requireName(const TableReader& table, const char* key, const std::string& what,
                 const std::vector<T>& list, const std::string& name)
{
    table.require(hasName(list, name), key, "the name of a " + what + " (" + namesOf(list) + ")");
}

void readBoxes(TableReader& r, Scene& s)
{
    for (auto& [name, table] :
         r.named({"box", "", "A kind of volume box, grown by a recursive function"})) {
        std::vector<std::string> materials;
        for (const Material& m : s.materials) materials.push_back(m.name);
        const std::string& key = name;
        s.boxes.erase(std::remove_if(s.boxes.begin(), s.boxes.end(),
                                     [&](const GrowthRule& p) { return p.name == key; }),
                      s.boxes.end());
        s.boxes.push_back(readGrowthRule(table, name, materials));
    }
}

void readSurfaces(TableReader& r, Scene& s)
{
    for (auto& [name, table] : r.named({"surface", "", "A surface that boxes stand on"})) {
        s.surfaces.push_back(readSurface(table, name));
        const std::string& skin = s.surfaces.back().skin.material;
        if (skin.empty()) continue;
        requireName(table, "skin", "material", s.materials, skin);
        const auto material = std::find_if(s.materials.begin(), s.materials.end(),
                                           [&](const Material& m) { return m.name == skin; });
        table.require(material->kind == MaterialKind::surface, "skin",
                      "a material of kind surface");
    }
}

void readLayers(TableReader& r, Scene& s)
{
    int index = 0;
    for (auto& table :
         r.tables({"layer", "", "One kind of box over one surface, with its second densities"})) {
        Layer layer = readLayer(table, index++);
        if (layer.surface.empty() && s.surfaces.size() == 1) layer.surface = s.surfaces[0].name;
        requireName(table, "box", "box", s.boxes, layer.box);
        requireName(table, "surface", "surface", s.surfaces, layer.surface);
        table.require(!hasName(s.layers, layer.name), "name", "a name that no other layer has");
        s.layers.push_back(std::move(layer));
    }
}

void readLights(TableReader& r, Scene& s)
{
    int index = 0;
    for (auto& table : r.tables({"light", "", "A light; any number of them"})) {
        Light light = readLight(table, index++);
        table.require(!hasName(s.lights, light.name), "name", "a name that no other light has");
        s.lights.push_back(std::move(light));
    }
}

Scene read(TableReader& r, int depth);

constexpr int kIncludeDepth = 8;

/// Adds the materials and boxes of other scene files, except those whose names this file has too.
void addIncluded(const std::vector<std::string>& names, TableReader& r, Scene& s, int depth)
{
    for (const std::string& name : names) {
        r.require(depth < kIncludeDepth, "include", "files that do not include each other");
        const std::filesystem::path file = r.file().parent_path() / name;
        r.require(std::filesystem::is_regular_file(file), "include",
                  "files relative to this one (there is no '" + file.string() + "')");
        TableReader other = TableReader::open(file);
        Scene included = read(other, depth + 1);
        s.included.push_back(file);
        s.included.insert(s.included.end(), included.included.begin(), included.included.end());
        for (Material& m : included.materials)
            if (!hasName(s.materials, m.name)) s.materials.push_back(std::move(m));
        for (GrowthRule& p : included.boxes)
            if (!hasName(s.boxes, p.name)) s.boxes.push_back(std::move(p));
    }
}

Scene read(TableReader& r, int depth)
{
    Scene s;
    s.file = r.file();
    const auto included = r.texts(
        {"include", "",
         "scene files, relative to this one, whose materials and boxes are used here as well; this file's own win"},
        {});
    for (auto& [name, table] :
         r.named({"material", "", "What voxels are made of: docs/MODEL.md, 4 and 5"}))
        s.materials.push_back(readMaterial(table, name));
    addIncluded(included, r, s, depth);
    readBoxes(r, s);
    readSurfaces(r, s);
    readLayers(r, s);
    TableReader compose = r.table({"compose", "", "How the placed boxes become one volume"});
    s.compose = readCompose(compose);
    TableReader camera = r.table({"camera", "", "Where the picture is taken from"});
    s.camera = readCamera(camera);
    readLights(r, s);
    TableReader render = r.table({"render", "", "The picture and how it is computed"});
    s.render = readRender(render);
    r.finish();
    return s;
}

} // namespace

Scene readScene(const std::filesystem::path& file)
{
    TableReader reader = TableReader::open(file);
    return read(reader, 0);
}

bool removeSurface(Scene& scene, const std::string& surface)
{
    if (!hasName(scene.surfaces, surface)) return false;
    const auto drop = [](auto& list, const auto& which) {
        list.erase(std::remove_if(list.begin(), list.end(), which), list.end());
    };
    drop(scene.surfaces, [&](const SurfaceSpec& s) { return s.name == surface; });
    drop(scene.layers, [&](const Layer& l) { return l.surface == surface; });
    return true;
}

std::vector<KeyDoc> sceneKeys()
{
    std::vector<KeyDoc> docs;
    TableReader reader = TableReader::describing(docs);
    read(reader, 0);
    return docs;
}

} // namespace volcomp
