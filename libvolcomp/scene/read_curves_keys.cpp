// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "volcomp/scene/readers.h"

namespace volcomp {

void requireMaterial(const TableReader& r, const Known<Material>& materials,
                     const std::string& name)
{
    if (materials.find(name)) return;
    r.require(false, "material", "the name of a material (" + materials.names() + ")");
}

FileAxes readFileAxes(TableReader& r)
{
    FileAxes axes;
    axes.scale = r.number({"scale", "m",
                           "length of one unit of the file of strands or of the mesh; 0: as the "
                           "file says, and 1 if it does not; glTF is in metres"},
                          axes.scale, {0, 1e9});
    enum class Up { file, x, y, z };
    const Up up = r.choice<Up>(
        {"up", "", "axis of that file that points up; file: as it says, and y if it does not"},
        Up::file, {{"file", Up::file}, {"x", Up::x}, {"y", Up::y}, {"z", Up::z}});
    if (up == Up::x) axes.up = UpAxis::x;
    if (up == Up::y) axes.up = UpAxis::y;
    if (up == Up::z) axes.up = UpAxis::z;
    return axes;
}

void readCurvesKeys(TableReader& r, CurvesSpec& c)
{
    c.width = r.number({"width", "m",
                        "thickness of strands whose file gives none for strands or points; 0: the "
                        "file's default"},
                       c.width, kNotNegative);
    const bool has_colour = r.has("colour_root") || r.has("colour_tip");
    const Vec3d root =
                    r.colour({"colour_root", "linear RGB",
                              "colour at the root, where the file has none for strands or points"},
                             Vec3d(0.5)),
                tip = r.colour(
                    {"colour_tip", "linear RGB", "colour at the tip; colour_root if left out"},
                    r.isDescribing() ? Vec3d(0.5) : root);
    if (has_colour) c.colour_root = root, c.colour_tip = tip;
    c.file_colours = r.choice<bool>(
        {"colours", "",
         "file: the file's colours, where it has some; keys: colour_root and colour_tip alone"},
        true, {{"file", true}, {"keys", false}});
    c.colour_map =
        r.path({"colour_map", "",
                "image that multiplies the colours, at the (u,v) of each strand's root; repeats"},
               "");
    for (const double group :
         r.numbers({"groups", "", "numbers of the groups of strands that are taken; empty: all"},
                   {}, {-1e9, 1e9})) {
        r.require(group == std::floor(group), "groups", "whole numbers");
        c.groups.push_back(static_cast<int>(group));
    }
    c.use_guides =
        r.choice<bool>({"guides", "", "strands that the file calls guides: leave_out or use"},
                       false, {{"leave_out", false}, {"use", true}});
}

GrowthRule readGroom(TableReader& r, const std::string& name, const Known<Material>& materials)
{
    GrowthRule rule;
    rule.name = name;
    rule.material = r.text({"material", "", "name of the material"}, std::nullopt);
    requireMaterial(r, materials, rule.material);
    CurvesSpec& curves = rule.curves.emplace();
    curves.groom = true;
    curves.file = r.path({"curves", "", "file of strands: .hair, .tfx, or lines of a .ply or .obj"},
                         std::nullopt);
    curves.axes = readFileAxes(r);
    readCurvesKeys(r, curves);
    curves.move =
        r.vector({"translate", "m", "added to every point, after the scale"}, curves.move);
    rule.voxel = r.number(
        {"voxel", "m",
         "edge of a voxel; 0: as the picture needs it at the nearest strand in view, but at least as wide as a strand"},
        rule.voxel, kNotNegative);
    rule.variants = r.integer(
        {"pieces", "",
         "the groom is cut by roots into so many boxes, which are baked, kept and culled each by itself"},
        32, {1, 1000});
    r.finish();
    rule.source = r.record();
    return rule;
}

} // namespace volcomp
