#include "scene.h"

#include <algorithm>

#include "error.h"

namespace volcomp {
namespace {

Scene read(TableReader& r)
{
    Scene s;
    s.file = r.file();
    for (auto& [name, table] : r.named({"material", "", "What voxels are made of: MODEL sections 4 and 5"})) s.materials.push_back(readMaterial(table, name));
    for (auto& [name, table] : r.named({"box", "", "A kind of volume box, grown by a recursive function"})) s.boxes.push_back(readPrimitive(table, name));
    for (auto& [name, table] : r.named({"surface", "", "A surface that boxes stand on"})) s.surfaces.push_back(readSurface(table, name));
    int index = 0;
    for (auto& table : r.tables({"layer", "", "One kind of box over one surface, with its second densities"})) s.layers.push_back(readLayer(table, index++));
    {
        TableReader table = r.table({"compose", "", "How the placed boxes become one volume"});
        s.compose = readCompose(table);
    }
    {
        TableReader table = r.table({"camera", "", "Where the picture is taken from"});
        s.camera = readCamera(table);
    }
    index = 0;
    for (auto& table : r.tables({"light", "", "A light; any number of them"})) s.lights.push_back(readLight(table, index++));
    {
        TableReader table = r.table({"render", "", "The picture and how it is computed"});
        s.render = readRender(table);
    }
    r.finish();
    return s;
}

template <class T>
std::string names(const std::vector<T>& list)
{
    std::string text;
    for (const T& x : list) text += (text.empty() ? "" : ", ") + x.name;
    return text.empty() ? "none" : text;
}

} // namespace

Scene readScene(const std::filesystem::path& file)
{
    TableReader reader = TableReader::open(file);
    return read(reader);
}

std::vector<KeyDoc> sceneKeys()
{
    std::vector<KeyDoc> docs;
    TableReader reader = TableReader::describing(docs);
    read(reader);
    return docs;
}

} // namespace volcomp
