// SPDX-License-Identifier: Apache-2.0
#include "volcomp/scene/readers.h"

#include <optional>

namespace volcomp {
namespace {

constexpr std::size_t kMostMatches = 1000; ///< each is compared with every part of a mesh

/// Throws the Error that points at the key unless it names a material that triangles may have.
void requireSurface(const TableReader& r, const Known<Material>& materials, const std::string& name)
{
    const Material* material = materials.find(name);
    r.require(material != nullptr, "material",
              "the name of a material (" + materials.names() + ")");
    r.require(material && material->kind == MaterialKind::surface, "material",
              "a material of kind surface, as triangles have normals");
}

MeshMatch readMatch(TableReader& r, const std::string& box_material)
{
    MeshMatch m;
    m.name =
        r.text({"name", "",
                "the triangles whose material, object, group or node in the file has this "
                "name; * stands for any letters, ? for any one; the first table that fits counts"},
               m.name);
    m.material =
        r.text({"material", "", "name of the material, of kind surface; the box's if left out"},
               box_material);
    m.texture = r.path(
        {"texture", "",
         "picture of the colour instead of the file's; by what it says in sRGB, linear or a gamma"},
        "");
    m.alpha = r.path(
        {"alpha", "",
         "picture, of data, that cuts the triangles out: its alpha, or without one its first channel; left out: the texture's own alpha, if it is given here or the file says that it cuts"},
        "");
    m.cutoff = r.number(
        {"cutoff", "", "alpha below it is nothing, from it on opaque; 0: nothing is cut out"},
        r.has("cutoff") ? std::nullopt : std::optional(0.5), {0, 1});
    if (!r.has("cutoff")) m.cutoff = -1;
    m.colour =
        r.colour({"colour", "linear RGB", "multiplies the file's colour or the texture"}, m.colour);
    m.solidity = r.choice<Solidity>(
        {"solid", "",
         "whether bodies are filled inside: auto fills those that are closed but for holes of less than a quarter of their area, and that no picture cuts out"},
        m.solidity, kSolidityWords);
    r.finish();
    return m;
}

} // namespace

void readMeshBox(TableReader& r, GrowthRule& rule, const Known<Material>& materials)
{
    MeshBox& mesh = rule.mesh;
    mesh.move = r.vector({"move", "m", "of a mesh: added after 'scale' and 'up'"}, mesh.move);
    for (TableReader& table :
         r.tables({"mesh_material", "", "What some triangles of a mesh are made of"})) {
        r.require(mesh.materials.size() < kMostMatches, "mesh_material", "at most 1000 tables");
        mesh.materials.push_back(readMatch(table, rule.material));
        requireSurface(table, materials, mesh.materials.back().material);
    }
    if (r.isDescribing()) return;
    if (!mesh.file.empty()) {
        requireSurface(r, materials, rule.material);
        return;
    }
    for (const char* key : {"move", "mesh_material"})
        r.require(!r.has(key), key, "a 'mesh' beside it");
}

} // namespace volcomp
