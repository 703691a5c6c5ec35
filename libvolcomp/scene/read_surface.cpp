// SPDX-License-Identifier: Apache-2.0
#include "volcomp/scene/readers.h"

namespace volcomp {
namespace {

MapProjection readProjection(TableReader& r)
{
    MapProjection p;
    p.kind = r.choice<ProjectionKind>(
        {"projection", "",
         "how maps fall on the surface: by the mesh's texture coordinates, or from a sphere, a cylinder or a plane"},
        p.kind,
        {{"uv", ProjectionKind::uv},
         {"sphere", ProjectionKind::sphere},
         {"cylinder", ProjectionKind::cylinder},
         {"plane", ProjectionKind::plane}});
    p.centre = r.vector({"centre", "m", "of the projection"}, p.centre);
    p.axis = r.direction(
        {"axis", "", "of the sphere's poles, of the cylinder, or across the plane"}, p.axis);
    p.up = r.direction(
        {"up", "",
         "sphere and cylinder: where the middle of the map faces; plane: the map's upward direction"},
        p.up);
    r.require(p.axis.cross(p.up).length() > 1e-6, "up",
              "a direction that is not parallel to 'axis'");
    const auto size =
        r.numbers({"projection_size", "m",
                   "[width, height] of the map on a plane; on a cylinder the height counts"},
                  {1, 1}, kPositive);
    r.require(size.size() == 2, "projection_size", "two numbers [width, height]");
    if (size.size() == 2) p.width = size[0], p.height = size[1];
    r.check([&] { p.validate(); });
    return p;
}

/// A plane or height field instead of a mesh.
void readTerrain(TableReader& r, SurfaceSpec& s)
{
    const auto ground = r.numbers(
        {"ground", "m",
         "instead of a mesh: [width, depth] of a plane in x and z, or of a height field; u runs along +X, v along -Z"},
        {}, kPositive);
    r.require((ground.size() == 2) != !s.mesh.empty(), s.mesh.empty() ? "ground" : "mesh",
              "either 'mesh' or 'ground = [width, depth]'");
    if (ground.size() == 2) s.terrain.width = ground[0], s.terrain.depth = ground[1];
    s.terrain.height_map =
        r.path({"height_map", "",
                "image whose luminance is the ground's height; data, never converted from sRGB"},
               "");
    const auto heights =
        r.numbers({"height", "m", "[at 0, at 1]: height of the ground where height_map is 0 and 1"},
                  {0, 1}, kAny);
    r.require(heights.size() == 2, "height", "two numbers");
    if (heights.size() == 2) s.terrain.low = heights[0], s.terrain.high = heights[1];
    s.terrain.cells = r.integer({"cells", "", "of the height field along its longer side"},
                                s.terrain.cells, {1, 8192});
}

void readSkin(TableReader& r, SkinSpec& skin, std::vector<std::string>& warnings)
{
    skin.material = r.text(
        {"skin", "",
         "name of a material of kind surface: the surface itself is seen, as skin_as says; empty: it is not"},
        "");
    skin.as = r.choice<SkinAs>(
        {"skin_as", "",
         "mesh: volcomp-render traces the surface itself beside the volume; voxels: volcomp-compose writes a thin opaque shell into the volume, for other programs that show it, and nothing is traced"},
        skin.as, kSkinAsWords);
    skin.colour = r.colour({"skin_colour", "", "diffuse colour of the skin"}, skin.colour);
    skin.maps = readMaps(
        r, "skin_map",
        "images, constants or noise that multiply skin_colour; a mesh is cut out where the images' alpha is below 0.5",
        true);
    skin.transmittance = r.number(
        {"skin_transmittance", "",
         "of voxels: what the shell lets through at tau = 1, seen from any side; a mesh is opaque"},
        skin.transmittance, {1e-30, 0.999});
    skin.depth = r.number(
        {"skin_depth", "voxels",
         "of voxels: depth of the shell's middle below the surface; a mesh is the surface"},
        skin.depth, {-1000, 1000});
    if (skin.as != SkinAs::mesh) return;
    for (const char* key : {"skin_transmittance", "skin_depth"})
        if (r.has(key))
            warnings.push_back(
                r.place() + ": '" + key
                + "' counts only with skin_as = \"voxels\": a skin that is a mesh is "
                  "the surface itself, and opaque.");
}

} // namespace

SurfaceSpec readSurface(TableReader& r, const std::string& name, std::vector<std::string>& warnings)
{
    SurfaceSpec s;
    s.name = name;
    s.mesh = r.path(
        {"mesh", "",
         "OBJ, PLY, OFF, STL or glTF file of polygons, which may be concave; faces without texture coordinates have (0, 0)"},
        "");
    readTerrain(r, s);
    s.scale = r.number({"scale", "m", "length of one unit of the file"}, s.scale, kPositive);
    s.move = r.vector({"translate", "m", "added to every point, after the scale"}, s.move);
    s.orientation = r.choice<Orientation>(
        {"orientation", "",
         "which side is outside: outward turns faces to agree with their neighbours and closed parts outward; file keeps what the file says; inward is the opposite of outward"},
        s.orientation,
        {{"outward", Orientation::outward},
         {"file", Orientation::file},
         {"inward", Orientation::inward}});
    s.projection = readProjection(r);
    readSkin(r, s.skin, warnings);
    r.finish();
    s.source = r.record();
    r.check([&] { s.validate(); });
    return s;
}

} // namespace volcomp
