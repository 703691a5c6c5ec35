// SPDX-License-Identifier: Apache-2.0
#include "volcomp/scene/readers.h"

namespace volcomp {

namespace {

void readSampling(TableReader& r, Layer& l)
{
    l.sampling = r.choice<Sampling>(
        {"sampling", "",
         "samples spread evenly on the surface (area) or in the map (uv); both stratified"},
        l.sampling, {{"area", Sampling::area}, {"uv", Sampling::uv}});
    l.density =
        r.number({"density", "1/m^2",
                  "boxes where the second density is 1: per square metre (area) or per cell (uv)"},
                 std::nullopt, {0, 1e12});
    const auto cells =
        r.integers({"cells", "", "[across, up]: cells of the map, for sampling = \"uv\""},
                   {l.cells_u, l.cells_v}, {1, 65536});
    l.cells_u = cells[0], l.cells_v = cells[1];
    l.sheets = r.choice<Sheets>(
        {"sheets", "",
         "if a projected line meets the surface several times: boxes on all sheets, or on the first from outside"},
        l.sheets, {{"all", Sheets::all}, {"first", Sheets::first}});
}

void readLayerMaps(TableReader& r, Layer& l)
{
    l.where = readMaps(r, "where", "Second density: the chance of a box, 0 to 1; factors multiply",
                       false);
    l.size = readMaps(r, "size_map", "Multiplies the size; factors multiply", false);
    l.colour = readMaps(r, "colour", "Multiplies the box's colour; factors multiply", true);
    l.tint = r.choice<TintAt>(
        {"tint", "",
         "the colour is looked up once at the box's root, or at every voxel, so that a border cuts through it"},
        l.tint, {{"root", TintAt::root}, {"voxel", TintAt::voxel}});
}

/// What is drawn at random for each box.
void readSpans(TableReader& r, Layer& l)
{
    l.scale = r.span({"size", "", "[smallest, largest] scale of a box, drawn evenly"}, l.scale,
                     {1e-6, 1e6});
    const auto turn =
        r.span({"turn_degrees", "degrees",
                "random turn about the box's axis; 0: the box's +X faces the comb direction"},
               std::pair(0.0, 360.0), {-360, 360});
    l.turn = {turn.first * kDegree, turn.second * kDegree};
    const auto tilt = r.span({"tilt_degrees", "degrees", "random tilt of the axis, to any side"},
                             std::pair(0.0, 0.0), {0, 180});
    l.tilt = {tilt.first * kDegree, tilt.second * kDegree};
}

void readComb(TableReader& r, Layer& l)
{
    l.combed = r.has("comb") || r.has("comb_map");
    l.comb = r.vector(
        {"comb", "", "world direction in which boxes lean along the surface; left out: none"},
        l.comb);
    l.comb_map =
        r.path({"comb_map", "",
                "image instead of 'comb': red, green, blue from 0 to 1 mean x, y, z from -1 to 1"},
               "");
    l.comb_space = r.choice<CombSpace>(
        {"comb_space", "", "axes of comb_map: x along u and y along v, or the world's"},
        l.comb_space, {{"tangent", CombSpace::tangent}, {"world", CombSpace::world}});
    l.comb_angle = kDegree
        * r.number(
            {"comb_degrees", "degrees", "how far combed boxes lean from the surface's normal"}, 45,
            {0, 180});
}

} // namespace

Layer readLayer(TableReader& r, int index)
{
    Layer l;
    l.source = r.toml();
    l.name = r.name({"name", "", "for messages and statistics; the random numbers depend on it"},
                    "layer" + std::to_string(index + 1));
    l.box = r.text({"box", "", "name of the box kind"}, std::nullopt);
    l.surface = r.text({"surface", "", "name of the surface; empty if the scene has only one"}, "");
    l.seed = r.seed({"seed", "", "of the random numbers"}, l.seed);
    readSampling(r, l);
    readLayerMaps(r, l);
    readSpans(r, l);
    readComb(r, l);
    l.upright = r.number(
        {"upright", "",
         "the axis of uncombed, untilted boxes: 0 along the surface's normal, 1 along the world's +Y, as trees grow on slopes"},
        l.upright, {0, 1});
    l.offset = r.number({"offset", "m", "of the root along the normal; negative: into the surface"},
                        l.offset, kAny);
    r.finish();
    r.check([&] { l.validate(); });
    return l;
}

} // namespace volcomp
