// SPDX-License-Identifier: Apache-2.0
#include "volcomp/grow/growth_rule.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "volcomp/base/error.h"
#include "volcomp/base/portable_math.h"
#include "volcomp/base/text.h"
#include "volcomp/grow/strand.h"

namespace volcomp {
namespace {

/// Segments and strands are counted in 32 bits.
constexpr double kMostSegments = 4294967295.0;

/// Distances between strands and the middles of clumps, of which about 10^9 are found in a second.
constexpr double kMostClumpDistances = 1e11;

/// Returns the keys that decide how many segments a level grows, with their values, in words.
std::string keysOfSize(const GrowthLevel& level)
{
    std::vector<std::string> keys;
    if (level.count.second > 1 || level.parent != "ground")
        keys.push_back(fmt::format("count (up to {:g})", level.count.second));
    if (level.segments > 1) keys.push_back(fmt::format("segments ({})", level.segments));
    if (level.depth > 1 && level.fork.second > 1) {
        keys.push_back(fmt::format("fork (up to {:g})", level.fork.second));
        keys.push_back(fmt::format("depth ({})", level.depth));
    }
    return joined(keys, " or ");
}

} // namespace

double outlineWidth(Outline outline, double s)
{
    switch (outline) {
    case Outline::stem:
        return 1;
    case Outline::blade:
        return 1 - s * s * s;
    case Outline::ellipse:
        return std::sqrt(std::max(0.0, 4 * s * (1 - s)));
    case Outline::ovate:
        return portable::sin(kPi * portable::pow(s, 0.6));
    case Outline::obovate:
        return std::sqrt(std::max(0.0, portable::sin(kPi * s * s)));
    }
    return 1;
}

int GrowthRule::parentOf(std::size_t i) const
{
    if (levels[i].parent == "ground") return -1;
    for (std::size_t k = 0; k < i; ++k)
        if (levels[k].name == levels[i].parent) return static_cast<int>(k);
    throw Error(fmt::format(
        "box {}: level '{}' stands on '{}', which is neither \"ground\" nor the name of a level above "
        "it",
        name, levels[i].name, levels[i].parent));
}

std::vector<double> GrowthRule::segmentBounds() const
{
    std::vector<std::vector<double>> strands(levels.size()); // by level and generation
    std::vector<double> bounds(levels.size(), 0);
    for (std::size_t i = 0; i < levels.size(); ++i) {
        const GrowthLevel& level = levels[i];
        const int parent = parentOf(i);
        double bearers = parent < 0 ? 1 : 0;
        if (parent >= 0)
            for (std::size_t d = 0; d < strands[parent].size(); ++d)
                if (d + 1 >= level.on_depth.first && d + 1 <= level.on_depth.second)
                    bearers += strands[parent][d];
        double count = bearers * mostDrawn(level.count);
        for (int d = 0; d < level.depth; ++d) {
            strands[i].push_back(count);
            bounds[i] += count * level.segments;
            count *= mostDrawn(level.fork);
        }
    }
    return bounds;
}

double GrowthRule::segmentBound() const
{
    double total = 0;
    for (const double bound : segmentBounds()) total += bound;
    return total;
}

/// Throws Error if the rule may grow more than it is allowed to, or for longer than anyone waits.
void GrowthRule::checkSize() const
{
    for (const GrowthLevel& l : levels) {
        const double strands = l.parent == "ground" && l.clump > 0 ? mostDrawn(l.count) : 0;
        if (strands * l.clumps > kMostClumpDistances)
            throw Error(fmt::format(
                "box {}: level '{}': clumps: expected at most {:.0f} for {:.0f} "
                "strands, found {}; lower clumps or count",
                name, l.name, std::floor(kMostClumpDistances / strands), strands, l.clumps));
    }
    const double bound = segmentBound(), limit = std::min(segment_limit, kMostSegments);
    if (bound <= limit) return;
    const std::vector<double> bounds = segmentBounds();
    const std::size_t most =
        static_cast<std::size_t>(std::max_element(bounds.begin(), bounds.end()) - bounds.begin());
    throw Error(fmt::format(
        "box {}: segment_limit: expected at most {:.10g} segments, found up to {:.6g}; {:.6g} of them "
        "are of level '{}': lower its {}{}",
        name, limit, bound, bounds[most], levels[most].name, keysOfSize(levels[most]),
        bound <= kMostSegments ? ", or raise segment_limit" : ""));
}

void GrowthRule::validate() const
{
    const auto check = [&](bool holds, const std::string& level, const char* key,
                           const std::string& expected, auto found) {
        if (!holds)
            throw Error(fmt::format("box {}: {}{}: expected {}, found {}", name,
                                    level.empty() ? "" : "level '" + level + "': ", key, expected,
                                    found));
    };
    check(variants >= 1, "", "variants", ">= 1", variants);
    check(segment_limit > 0, "", "segment_limit", "a number > 0", segment_limit);
    check(std::isfinite(voxel) && voxel >= 0, "", "voxel", "a length >= 0", voxel);
    for (const GrowthLevel& l : levels) {
        const auto finite = [&](const char* key, double x, double low, double high = 1e6) {
            check(std::isfinite(x) && x >= low && x <= high, l.name, key,
                  fmt::format("{:g} to {:g}", low, high), x);
        };
        const auto span = [&](const char* key, const GrowthLevel::Span& s, double low,
                              double high) {
            finite(key, s.first, low, high);
            finite(key, s.second, s.first, high);
        };
        check(l.depth >= 1 && l.depth <= 100, l.name, "depth", "1 to 100", l.depth);
        check(l.segments >= 1, l.name, "segments", ">= 1", l.segments);
        check(l.whorl >= 1, l.name, "whorl", ">= 1", l.whorl);
        check(l.clumps >= 1, l.name, "clumps", ">= 1", l.clumps);
        span("count", l.count, 0, 1e9);
        span("fork", l.fork, 0, 1e9);
        span("on_depth", l.on_depth, 1, 100);
        span("angle", l.angle, -1e6, 1e6);
        finite("start", l.start, 0, 1);
        finite("end", l.end, 0, 1);
        finite("fork_start", l.fork_start, 0, 1);
        for (const auto& [key, x] : {std::pair("spread", l.spread),
                                     {"length", l.length},
                                     {"length_ratio", l.length_ratio},
                                     {"length_tip", l.length_tip},
                                     {"length_variation", l.length_variation},
                                     {"radius", l.radius},
                                     {"radius_ratio", l.radius_ratio},
                                     {"width_ratio", l.width_ratio},
                                     {"divergence_variation", l.divergence_variation},
                                     {"wander", l.wander},
                                     {"bend_variation", l.bend_variation},
                                     {"curl_radius", l.curl_radius},
                                     {"frizz", l.frizz},
                                     {"colour_variation", l.colour_variation}})
            finite(key, x, 0);
        for (const auto& [key, x] : {std::pair("divergence", l.divergence),
                                     {"angle_tip", l.angle_tip},
                                     {"bend", l.bend},
                                     {"comb", l.comb},
                                     {"twist", l.twist},
                                     {"gravity", l.gravity},
                                     {"light", l.light},
                                     {"curl_turns", l.curl_turns}})
            finite(key, x, -1e6);
        finite("taper", l.taper, 0, 1);
        finite("facing", l.facing, 0, 1);
        finite("clump", l.clump, 0, 1);
        for (int c = 0; c < 3; ++c) {
            finite("colour_root", l.colour_root[c], 0);
            finite("colour_tip", l.colour_tip[c], 0);
        }
    }
    checkSize();
}

} // namespace volcomp
