// SPDX-License-Identifier: Apache-2.0
#include "volcomp/scene/readers.h"

#include <algorithm>

#include <fmt/format.h>

namespace volcomp {
namespace {

/// Throws the Error that points at the key if the level stands on none that is there, or has a name
/// that is taken.
void requireParent(const TableReader& r, const GrowthRule& rule, const GrowthLevel& l)
{
    const auto known = [&](const std::string& name) {
        return name == "ground"
            || std::any_of(rule.levels.begin(), rule.levels.end(),
                           [&](const GrowthLevel& other) { return other.name == name; });
    };
    if (!known(l.parent)) {
        std::string names = "ground";
        for (const GrowthLevel& other : rule.levels) names += ", " + other.name;
        r.require(false, "parent", "the name of a level above (" + names + ")");
    }
    r.require(!known(l.name), "name", "a name that no other level has, and not \"ground\"");
}

/// Appends a warning if the level grows on the one above for want of a parent and has a key that
/// counts on the ground only: then it is likely that it was meant to stand on the ground.
void warnOfParent(const TableReader& r, const GrowthRule& rule, const GrowthLevel& l,
                  std::vector<std::string>& warnings)
{
    if (rule.levels.empty() || r.has("parent")) return;
    for (const char* key : {"spread", "clump", "clumps"})
        if (r.has(key)) {
            warnings.push_back(fmt::format(
                "{}: level '{}' grows on '{}', the level above it, as it has no 'parent'; its '{}' counts on the ground only. Write parent = \"ground\" if it stands there, or leave '{}' out",
                r.place(), l.name, l.parent, key, key));
            return;
        }
}

constexpr std::size_t kMostLevels = 1000; ///< of a box; each is compared with those above it

// Keys whose default is the value that the level has already.
void degrees(TableReader& r, const Key& key, double& value)
{
    value = r.number(key, value / kDegree, kAny) * kDegree;
}
void positive(TableReader& r, const Key& key, double& value)
{
    value = r.number(key, value, kNotNegative);
}
void unit(TableReader& r, const Key& key, double& value) { value = r.number(key, value, kUnit); }

/// The level's name, what it stands on, and its material.
void readNames(TableReader& r, const GrowthRule& rule, const Known<Material>& materials,
               GrowthLevel& l)
{
    const GrowthLevel* above = rule.levels.empty() ? nullptr : &rule.levels.back();
    l.name = r.name({"name", "", "what other levels call it"},
                    "level" + std::to_string(rule.levels.size() + 1));
    l.parent = r.text(
        {"parent", "",
         "level that it grows on, or \"ground\"; the first level's is the ground, another's the level above it"},
        above ? above->name : "ground");
    requireParent(r, rule, l);
    l.material =
        r.text({"material", "", "name of the material; the box's if left out"}, rule.material);
    requireMaterial(r, materials, l.material);
}

/// The shape of its strands, and how often it grows on itself.
void readGenerations(TableReader& r, GrowthLevel& l)
{
    l.outline = r.choice<Outline>(
        {"outline", "",
         "stem: a round cone; the others are flat: blade pointed, ellipse, ovate widest near the root, obovate near the tip"},
        l.outline,
        {{"stem", Outline::stem},
         {"blade", Outline::blade},
         {"ellipse", Outline::ellipse},
         {"ovate", Outline::ovate},
         {"obovate", Outline::obovate}});
    l.depth = r.integer(
        {"depth", "",
         "generations of this level: each strand bears others of its own level until the depth is reached"},
        l.depth, {1, 100});
    l.fork =
        r.span({"fork", "", "how many of its own level a strand bears, below the last generation"},
               l.fork, {0, 1e9});
    unit(r, {"fork_start", "", "fraction of the strand from which on it forks"}, l.fork_start);
    l.on_depth = r.span(
        {"on_depth", "", "generations of the parent's level that bear this one, counted from 1"},
        l.on_depth, {1, 100});
}

/// How many strands there are, and where they stand.
void readPlaces(TableReader& r, GrowthLevel& l)
{
    l.count = r.span({"count", "", "how many: on the ground in all, otherwise on each parent"},
                     l.count, {0, 1e9});
    l.whorl = r.integer({"whorl", "", "how many of them stand at one node"}, l.whorl, {1, 1e6});
    unit(r, {"start", "", "fraction of the parent where the first stands"}, l.start);
    unit(r, {"end", "", "fraction of the parent where the last stands"}, l.end);
    r.require(l.end >= l.start, "end", "at least start");
    positive(r, {"spread", "m", "on the ground: radius of the disc where roots stand"}, l.spread);
    degrees(r, {"divergence_degrees", "degrees", "turn about the parent from node to node"},
            l.divergence);
    l.divergence_variation =
        r.number({"divergence_variation_degrees", "degrees", "its standard deviation"}, 0,
                 kNotNegative)
        * kDegree;
    l.planar =
        r.flag({"planar", "", "stand to the left and right of the parent only (fern)"}, l.planar);
}

/// The direction, length and thickness of its strands.
void readSizes(TableReader& r, GrowthLevel& l)
{
    const auto angle = r.span({"angle_degrees", "degrees",
                               "from the parent's direction; on the ground from +Y, outwards"},
                              GrowthLevel::Span{0, 0}, kAny);
    l.angle = {angle.first * kDegree, angle.second * kDegree};
    l.angle_tip =
        r.number({"angle_tip", "", "factor on the angle at the parent's tip"}, l.angle_tip, kAny);
    positive(r, {"length", "m", "length; 0: length_ratio of the parent's"}, l.length);
    positive(
        r,
        {"length_ratio", "", "length as a part of the parent's, also if the level grows on itself"},
        l.length_ratio);
    positive(r, {"length_tip", "", "factor on the length at the parent's tip"}, l.length_tip);
    positive(r, {"length_variation", "", "standard deviation as a part of the length"},
             l.length_variation);
    positive(r, {"radius", "m", "radius at the root; 0: radius_ratio of the parent's there"},
             l.radius);
    positive(r, {"radius_ratio", "", "radius at the root as a part of the parent's there"},
             l.radius_ratio);
    unit(r, {"taper", "", "part of the radius that is lost to the tip"}, l.taper);
    positive(r, {"width_ratio", "", "flat outlines: greatest width / length"}, l.width_ratio);
    l.segments = r.integer({"segments", "", "pieces of each strand"}, l.segments, {1, 10000});
}

/// How its strands bend over their length.
void readBends(TableReader& r, GrowthLevel& l)
{
    degrees(r, {"bend_degrees", "degrees", "bend over the length, away from the parent's tip"},
            l.bend);
    l.bend_variation =
        r.number({"bend_variation_degrees", "degrees", "its standard deviation"}, 0, kNotNegative)
        * kDegree;
    degrees(r, {"comb_degrees", "degrees", "bend over the length towards the box's +X"}, l.comb);
    degrees(r, {"twist_degrees", "degrees", "twist about its own axis over the length"}, l.twist);
    l.wander =
        r.number({"wander_degrees", "degrees", "random turns over the length, standard deviation"},
                 0, kNotNegative)
        * kDegree;
    degrees(r,
            {"gravity_degrees", "degrees", "turn towards -Y over the length, for a level strand"},
            l.gravity);
    degrees(r, {"light_degrees", "degrees", "turn towards +Y over the length, for a level strand"},
            l.light);
    unit(r, {"facing", "", "how much a flat shape turns its face to +Y"}, l.facing);
    positive(r, {"curl_radius", "m", "radius of the helix around the strand's line"},
             l.curl_radius);
    l.curl_turns =
        r.number({"curl_turns", "", "turns of the helix over the length"}, l.curl_turns, kAny);
    positive(r, {"frizz", "", "random sideways shift as a part of the length"}, l.frizz);
    unit(r, {"clump", "", "on the ground: how much the tips of a clump meet"}, l.clump);
    l.clumps = r.integer({"clumps", "", "number of clumps"}, l.clumps, {1, 1e6});
}

void readColours(TableReader& r, GrowthLevel& l)
{
    l.colour_root = r.colour({"colour_root", "linear RGB", "colour at the root"}, l.colour_root);
    l.colour_tip =
        r.colour({"colour_tip", "linear RGB", "colour at the tip; colour_root if left out"},
                 r.isDescribing() ? l.colour_tip : l.colour_root);
    positive(
        r, {"colour_variation", "", "standard deviation of a strand's brightness, as a part of it"},
        l.colour_variation);
}

GrowthLevel readLevel(TableReader& r, const GrowthRule& rule, const Known<Material>& materials,
                      const Presets& presets, std::vector<std::string>& warnings)
{
    GrowthLevel l;
    r.inherit({"use", "", "a [preset.NAME], whose keys count where this level has none"}, presets);
    readNames(r, rule, materials, l);
    warnOfParent(r, rule, l, warnings);
    readGenerations(r, l);
    readPlaces(r, l);
    readSizes(r, l);
    readBends(r, l);
    readColours(r, l);
    r.finish();
    return l;
}

} // namespace

GrowthRule readGrowthRule(TableReader& r, const std::string& name, const Known<Material>& materials,
                          const Presets& presets, std::vector<std::string>& warnings)
{
    GrowthRule p;
    p.name = name;
    p.material =
        r.text({"material", "", "name of the material of the levels that name none"}, std::nullopt);
    requireMaterial(r, materials, p.material);
    p.variants =
        r.integer({"variants", "", "boxes baked, which differ by their random numbers only"},
                  r.has("mesh") ? 1 : p.variants, {1, r.has("mesh") ? 1.0 : 1000.0});
    p.seed = r.seed({"seed", "", "of the random numbers"}, p.seed);
    p.voxel =
        r.number({"voxel", "m", "edge of a voxel; 0: from the thinnest feature worth showing"},
                 p.voxel, kNotNegative);
    p.segment_limit =
        r.number({"segment_limit", "", "a recursion that may grow more segments is refused"},
                 p.segment_limit, kPositive);
    p.files = r.paths(
        {"files", "",
         "instead of levels: VDB files with a fog volume `density` each, one for each variant; metres, root at the origin, +Y up. They are taken as they are, and not baked"},
        {});
    if (!p.files.empty()) p.variants = int(std::min<std::size_t>(p.files.size(), 1000));
    const std::filesystem::path curves = r.path(
        {"curves", "",
         "instead of levels: a file of strands (.hair, .tfx, or lines of a .ply or .obj), which are cut by their roots into as many tufts as there are variants"},
        "");
    p.mesh.file = r.path(
        {"mesh", "",
         "instead of levels: a mesh (OBJ with MTL, glTF, GLB, PLY, OFF or STL) whose triangles fill the voxels; its origin is the box's root"},
        "");
    const FileAxes axes = readFileAxes(r);
    for (const char* key : {"scale", "up"})
        r.require(r.isDescribing() || !r.has(key) || !curves.empty() || !p.mesh.file.empty(), key,
                  "'curves' or a 'mesh' beside it");
    if (!curves.empty() || r.isDescribing()) {
        p.curves.emplace().file = curves;
        p.curves->axes = axes;
        readCurvesKeys(r, *p.curves);
    }
    p.mesh.axes = axes;
    readMeshBox(r, p, materials);
    for (
        TableReader& table : r.tables(
            {"level", "",
             "One level of the recursion: strands or flat shapes, on the ground or on another level"})) {
        r.require(p.levels.size() < kMostLevels, "level",
                  fmt::format("at most {} levels", kMostLevels));
        p.levels.push_back(readLevel(table, p, materials, presets, warnings));
    }
    r.finish();
    p.source = r.record();
    if (!r.isDescribing()) {
        const int ways = int(!p.levels.empty()) + int(p.curves.has_value())
            + int(!p.mesh.file.empty()) + int(!p.files.empty());
        r.require(ways == 1, "level",
                  "either at least one [[box." + name
                      + ".level]] or one of 'curves', 'mesh' and 'files'");
        r.require(p.files.size() <= 1000, "files", "at most 1000 files");
        r.check([&] { p.validate(); });
    }
    return p;
}

} // namespace volcomp
