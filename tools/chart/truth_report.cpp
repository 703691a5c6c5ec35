// SPDX-License-Identifier: Apache-2.0
#include "tools/chart/truth_report.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace volcomp {
namespace {

using nlohmann::json;

/// A ratio with two digits.
std::string times(double ratio)
{
    return ratio >= 9.95 ? fmt::format("{:.0f}", ratio)
        : ratio >= 0.995 ? fmt::format("{:.1f}", ratio)
                         : fmt::format("{:.2g}", ratio);
}

std::string percent(double part)
{
    const double p = 100 * part;
    return std::abs(p) >= 9.95 ? fmt::format("{:.0f} %", p) : fmt::format("{:.2g} %", p);
}

/// The time of a volume in that of curves with the same error; 0 if it is not known.
double ratioOf(const TruthResult& r, const EqualError& curves)
{
    return curves.from == EqualError::From::nothing ? 0 : r.costs.sum().cpu / curves.seconds;
}

std::string wordsOf(const EqualError& curves)
{
    const std::string samples = curves.samples < 9.95 ? fmt::format("{:.1f}", curves.samples)
                                                      : fmt::format("{:.0f}", curves.samples);
    switch (curves.from) {
    case EqualError::From::coarsest:
        return fmt::format("{:.0f} sample{}, which is already better", curves.samples,
                           curves.samples == 1 ? "" : "s");
    case EqualError::From::between:
        return "interpolated: " + samples + " samples";
    case EqualError::From::beyond:
        return "extrapolated: " + samples + " samples, error as one over their square root";
    case EqualError::From::nothing:
        break;
    }
    return "";
}

/// The cell of a table: "0.21", with a mark if it is extrapolated or a bound.
std::string cellOf(const TruthResult& r, const EqualError& curves)
{
    if (r.curves || curves.from == EqualError::From::nothing) return "";
    const std::string mark = curves.from == EqualError::From::beyond ? " *"
        : curves.from == EqualError::From::coarsest                  ? " +"
                                                                     : "";
    return times(ratioOf(r, curves)) + mark;
}

/// What a volume takes at equal error, as a sentence.
std::string sentence(const TruthResult& r, const std::string& what, double error,
                     const EqualError& curves)
{
    if (curves.from == EqualError::From::nothing)
        return fmt::format("The error {} of {} cannot be told from 0.\n\n", what, nameOf(r));
    return fmt::format("At equal error {} ({}), {} takes {} times the time of curves: {:.2f} "
                       "against {:.2f} CPU seconds ({}).\n\n",
                       what, percent(error), nameOf(r), times(ratioOf(r, curves)),
                       r.costs.sum().cpu, curves.seconds, wordsOf(curves));
}

json toJson(const Cost& cost) { return {{"cpu_seconds", cost.cpu}, {"wall_seconds", cost.wall}}; }

json toJson(const TruthResult& r, const EqualError& curves)
{
    if (curves.from == EqualError::From::nothing) return nullptr;
    const char* from[] = {"", "coarsest", "interpolated", "extrapolated"};
    return {{"curves_cpu_seconds", curves.seconds},
            {"curves_samples", curves.samples},
            {"times_of_curves", ratioOf(r, curves)},
            {"from", from[int(curves.from)]}};
}

std::string seenFrom(const std::filesystem::path& directory, const std::filesystem::path& file)
{
    return file.lexically_relative(directory).string();
}

json toJson(const std::vector<TruthResult>& results, const std::filesystem::path& directory)
{
    json all;
    for (const TruthResult& r : results) {
        const PictureError& e = r.error;
        json row = {{"name", nameOf(r)},
                    {"kind", r.curves ? "curves" : "volume"},
                    {"samples", r.row.samples},
                    {"picture", seenFrom(directory, r.picture)},
                    {"error", toJson(e)},
                    {"cost",
                     {{"bake", toJson(r.costs.bake)},
                      {"build", toJson(r.costs.build)},
                      {"load", toJson(r.costs.load)},
                      {"picture", toJson(r.costs.picture)},
                      {"sum", toJson(r.costs.sum())}}}};
        if (!r.curves) {
            row["voxel_m"] = r.voxel;
            row["voxel_factor"] = r.row.factor;
            row["filter"] = wordOf(kFilterWords, r.row.filter);
            row["shadows"] = wordOf(kShadowsWords, r.row.shadows);
            row["equal_pixels"] = toJson(r, r.at_pixels);
            row["equal_blocks"] = toJson(r, r.at_blocks);
        }
        all.push_back(std::move(row));
    }
    return all;
}

} // namespace

std::string nameOf(const TruthResult& r)
{
    const std::string samples =
        fmt::format("{} sample{}", r.row.samples, r.row.samples == 1 ? "" : "s");
    return r.curves
        ? "curves, " + samples
        : fmt::format("voxels x{:g}, {}, {}, {}", r.row.factor, wordOf(kFilterWords, r.row.filter),
                      wordOf(kShadowsWords, r.row.shadows), samples);
}

const TruthResult* referenceOf(const std::vector<TruthResult>& results)
{
    const auto away = [](const TruthResult& r) { return std::abs(std::log(r.row.factor)); };
    const TruthResult* best = nullptr;
    for (const TruthResult& r : results) {
        if (r.curves || r.row.filter != Filter::box || r.row.shadows != Shadows::sweep) continue;
        const bool nearer = !best || away(r) < away(*best),
                   as_near = best && away(r) == away(*best);
        if (nearer || (as_near && ratioOf(r, r.at_blocks) < ratioOf(*best, best->at_blocks)))
            best = &r;
    }
    return best;
}

std::string truthTitle(const std::string& scene, const std::vector<TruthResult>& results)
{
    const TruthResult* r = referenceOf(results);
    const double ratio = r ? ratioOf(*r, r->at_blocks) : 0;
    if (ratio <= 0) return scene + ": pictures of volumes and of curves";
    const std::string end = " at equal error in blocks";
    if (ratio > 1.15)
        return fmt::format("{}: curves are {} times cheaper than volumes{}", scene, times(ratio),
                           end);
    if (ratio < 1 / 1.15)
        return fmt::format("{}: volumes are {} times cheaper than curves{}", scene,
                           times(1 / ratio), end);
    return fmt::format("{}: volumes cost about as much as curves{}", scene, end);
}

std::string truthSentences(const std::vector<TruthResult>& results)
{
    const TruthResult *r = referenceOf(results), *best = nullptr;
    if (!r) return "";
    std::string text;
    for (const TruthResult& other : results) // the line of the reference
        if (!other.curves && other.row.factor == r->row.factor && other.row.filter == r->row.filter
            && other.row.shadows == r->row.shadows)
            text += sentence(other, "in blocks", other.error.block_rmse, other.at_blocks);
    text += sentence(*r, "per pixel", r->error.rmse, r->at_pixels);
    int known = 0, cheaper = 0;
    for (const TruthResult& other : results) {
        const double ratio = ratioOf(other, other.at_blocks);
        if (other.curves || ratio <= 0) continue;
        ++known;
        cheaper += ratio < 1;
        if (!best || ratio < ratioOf(*best, best->at_blocks)) best = &other;
    }
    if (best && best != r)
        text += sentence(*best, "in blocks", best->error.block_rmse, best->at_blocks);
    return text
        + fmt::format("Of {} settings of volumes {} are cheaper than curves of the same error in "
                      "blocks.\n",
                      known, cheaper);
}

std::string truthTable(const std::vector<TruthResult>& results)
{
    std::string text =
        "| picture | error per pixel | in 4x4 blocks | bias of the mean | bias of alpha | bake | "
        "compose or tree | load | picture | CPU s in all | times curves, equal pixels | times "
        "curves, equal blocks |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n";
    for (const TruthResult& r : results)
        text += fmt::format(
            "| {} | {:.4f} | {:.4f} | {:+.1f} % | {:+.4f} | {} | {:.2f} | {:.2f} | {:.2f} | {:.2f} "
            "| {} | {} |\n",
            nameOf(r), r.error.rmse, r.error.block_rmse, 100 * r.error.bias, r.error.alpha_bias,
            r.curves ? "" : fmt::format("{:.2f}", r.costs.bake.cpu), r.costs.build.cpu,
            r.costs.load.cpu, r.costs.picture.cpu, r.costs.sum().cpu, cellOf(r, r.at_pixels),
            cellOf(r, r.at_blocks));
    return text
        + "\nErrors are root mean squares relative to the mean of the exact picture, without its "
          "noise; below 0: not to be told from 0. \\*: the curves' time is extrapolated beyond the "
          "most samples measured, error as one over the square root of the samples. +: the fewest "
          "samples of curves already have a smaller error.\n";
}

json truthJson(const std::vector<TruthOfLight>& lights, const TruthSetup& setup,
               const std::filesystem::path& directory)
{
    json all = {{"width", setup.width}, {"height", setup.height}, {"voxel_m", setup.voxel}};
    for (const TruthOfLight& l : lights) {
        const json found = {
            {"exact", {{"samples", setup.samples}, {"picture", seenFrom(directory, l.exact)}}},
            {"results", toJson(l.results, directory)}};
        if (l.light.own()) all.update(found);
        else all["other_lights"][l.light.name] = found;
    }
    return all;
}

} // namespace volcomp
