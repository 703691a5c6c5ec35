// SPDX-License-Identifier: Apache-2.0
#include "volcomp/scene/readers.h"

#include <optional>

namespace volcomp {

namespace {

void readSampling(TableReader& r, Layer& l)
{
    l.sampling = r.choice<Sampling>(
        {"sampling", "",
         "samples spread evenly on the surface (area) or in the map (uv); both stratified"},
        l.sampling, {{"area", Sampling::area}, {"uv", Sampling::uv}});
    l.points = r.path(
        {"points", "",
         "instead of samples: a PLY, CSV or JSON file of places in world space. x y z, and if they are there nx ny nz (the axis), qx qy qz qw (the rotation), scale, variant (from 1), red green blue (linear; multiply the colour), box; JSON as compose --placements writes it. 'size', 'where', masks, spacing and, without a rotation, the angles count on top"},
        "");
    l.density = r.number(
        {"density", "1/m^2",
         "boxes where the second density is 1: per square metre (area) or per cell (uv); without 'points' it must be given"},
        l.points.empty() && !r.isDescribing() ? std::nullopt : std::optional(0.0), {0, 1e12});
    const auto cells = r.integers(
        {"cells", "",
         "[across, up]: cells of the map, for sampling = \"uv\": of every unit square of (u,v) that the surface reaches"},
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
    l.tilt_map = readMaps(r, "tilt_map", "Multiplies tilt_degrees; factors multiply", false);
    l.comb_angle_map =
        readMaps(r, "comb_degrees_map", "Multiplies comb_degrees; factors multiply", false);
    l.tint = r.choice<TintAt>(
        {"tint", "",
         "the colour is looked up once at the box's root, or at every voxel, so that a border cuts through it"},
        l.tint, {{"root", TintAt::root}, {"voxel", TintAt::voxel}});
}

/// The key `name` and what it fades over, `name`_fade without the unit; in the file's unit.
Mask readMask(TableReader& r, const Key& key, const Key& fade, Interval range)
{
    Mask mask;
    const auto span = r.span(key, std::pair(range.low, range.high), range);
    mask.fade = r.number(fade, 0, kNotNegative);
    if (r.has(key.name)) mask.low = span.first, mask.high = span.second;
    return mask;
}

void readAvoid(TableReader& r, Layer& l)
{
    for (TableReader& t :
         r.tables({"avoid", "", "Something that this layer's roots keep away from"})) {
        Avoid avoid;
        avoid.layer = t.text({"layer", "", "name of a layer above: its roots"}, "");
        avoid.surface = t.text({"surface", "", "or name of a surface, not the layer's own"}, "");
        avoid.distance =
            t.number({"distance", "m", "of roots, at least"}, avoid.distance, kNotNegative);
        t.require(avoid.layer.empty() != avoid.surface.empty(), "layer",
                  "either a layer or a surface");
        t.finish();
        if (!t.isDescribing()) l.avoid.push_back(std::move(avoid));
    }
}

/// Where boxes do not stand.
void readRoom(TableReader& r, Layer& l)
{
    l.spacing = r.number(
        {"spacing", "m",
         "least distance of two roots; of two sizes, or of two layers that have a spacing, the mean of spacing times size. Samples stay, in their order, where there is room: a full cover needs a density of about 10 / spacing^2. 0: any distance"},
        l.spacing, kNotNegative);
    readAvoid(r, l);
    const Interval slopes{0, 180};
    l.slope = readMask(r,
                       {"slope_degrees", "degrees",
                        "[least, most] slope of the surface where boxes stand: 0 level, 90 a wall"},
                       {"slope_fade_degrees", "degrees",
                        "beyond 'slope_degrees' the chance of a box goes to 0 over so much"},
                       slopes);
    for (double* angle : {&l.slope.low, &l.slope.high, &l.slope.fade}) *angle *= kDegree;
    l.height =
        readMask(r, {"height", "m", "[least, most] height (world Y) where boxes stand"},
                 {"height_fade", "m", "beyond 'height' the chance of a box goes to 0 over so much"},
                 {-1e6, 1e6});
}

/// What is drawn at random for each box.
void readSpans(TableReader& r, Layer& l)
{
    l.scale = r.span({"size", "", "[smallest, largest] scale of a box, drawn evenly"}, l.scale,
                     {1e-6, 1e6});
    l.sizes = r.choice<SizeDistribution>(
        {"size_distribution", "",
         "of 'size': even; normal, with its mean in the middle and a standard deviation of a quarter of the span; power, whose density goes with size^size_power"},
        l.sizes,
        {{"even", SizeDistribution::even},
         {"normal", SizeDistribution::normal},
         {"power", SizeDistribution::power}});
    l.size_power = r.number({"size_power", "", "for size_distribution = \"power\""}, l.size_power,
                            {-100, 100});
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
    l.comb_map = r.path(
        {"comb_map", "",
         "image instead of 'comb', of data (never converted from sRGB): red, green, blue from 0 to 1 mean x, y, z from -1 to 1; neutral grey means no direction, as without a comb, and the length does not count"},
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

Layer readPlace(TableReader& r, int index)
{
    Layer l;
    l.name = r.name({"name", "", "for messages and lists"}, "place" + std::to_string(index + 1));
    l.box = r.text({"box", "", "name of the box kind"}, std::nullopt);
    l.surface = r.text(
        {"surface", "", "name of the surface that it belongs to; empty if the scene has only one"},
        "");
    GivenPlace p;
    p.variant = r.integer({"variant", "", "which of the box's variants, from 1"}, 1, {1, 1000}) - 1;
    p.position = r.vector({"position", "m", "of the box's root in the world"}, std::nullopt);
    p.normal = r.direction({"up", "", "direction of the box's axis"}, Vec3d(0, 1, 0));
    const double turn = kDegree
        * r.number({"turn_degrees", "degrees", "about the axis; 0: +X stays +X, upright"}, 0, kAny);
    l.turn = {turn, turn};
    p.scale = r.number({"size", "", "scale of the box"}, 1, {1e-6, 1e6});
    p.tint = Vec3f(r.colour({"colour", "linear RGB", "multiplies the box's colour"}, Vec3d(1.0)));
    r.finish();
    l.source = r.record();
    l.places = {p};
    r.check([&] { l.validate(); });
    return l;
}

Layer readLayer(TableReader& r, int index)
{
    Layer l;
    l.name = r.name({"name", "", "for messages and statistics; the random numbers depend on it"},
                    "layer" + std::to_string(index + 1));
    l.box = r.text({"box", "", "name of the box kind"}, std::nullopt);
    l.surface = r.text({"surface", "", "name of the surface; empty if the scene has only one"}, "");
    l.seed = r.seed({"seed", "", "of the random numbers"}, l.seed);
    readSampling(r, l);
    readLayerMaps(r, l);
    readRoom(r, l);
    readSpans(r, l);
    readComb(r, l);
    l.upright = r.number(
        {"upright", "",
         "the axis of uncombed, untilted boxes: 0 along the surface's normal, 1 along the world's +Y, as trees grow on slopes"},
        l.upright, {0, 1});
    l.offset = r.number({"offset", "m", "of the root along the normal; negative: into the surface"},
                        l.offset, kAny);
    r.finish();
    l.source = r.record();
    r.check([&] { l.validate(); });
    return l;
}

} // namespace volcomp
