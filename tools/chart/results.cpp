// SPDX-License-Identifier: Apache-2.0
#include "tools/chart/results.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "tools/chart/chart.h"
#include "volcomp/base/error.h"

namespace volcomp {
namespace {

std::size_t indexOf(const Image& image, const std::string& name)
{
    const auto at = std::find(image.channels.begin(), image.channels.end(), name);
    if (at == image.channels.end()) throw Error("a picture has no channel " + name);
    return std::size_t(at - image.channels.begin());
}

std::string choiceTable(const std::string& title, const std::vector<ChartPoint>& points)
{
    std::string text =
        "| " + title + ": error at most | choose | error | CPU seconds |\n|---|---|---|---|\n";
    for (const double limit : {1e-1, 1e-2, 1e-3, 1e-4}) {
        const int best = cheapestWithin(points, limit);
        if (best >= 0)
            text += fmt::format(
                "| {:g} | {} | {} | {:.2f} |\n", limit, points[best].name,
                points[best].y < kLeastError ? "below 1e-6" : fmt::format("{:.2g}", points[best].y),
                points[best].x);
        else text += fmt::format("| {:g} | none of these | | |\n", limit);
    }
    return text;
}

std::string otherLightTable(const std::vector<Result>& radiance)
{
    std::string rows;
    for (const Result& r : radiance) {
        if (!r.other_light) continue;
        const auto own = std::find_if(radiance.begin(), radiance.end(), [&](const Result& other) {
            return !other.other_light && other.settings.at("samples") == r.settings.at("samples")
                && other.row.family == kOwnLightFamily;
        });
        rows += fmt::format(
            "| {} | {:.2g} | {} | {:.2f} | {} |\n", r.row.name, r.error,
            r.method_error < 0 ? "" : fmt::format("{:.2g}", r.method_error), r.cpu_seconds,
            own == radiance.end() ? "" : fmt::format("{:.2f}", r.cpu_seconds / own->cpu_seconds));
    }
    if (rows.empty()) return "";
    return "\n| other light, box, sweep, samples | error against this light | the same rays | CPU "
           "seconds | times the scene's light |\n|---|---|---|---|---|\n"
        + rows;
}

} // namespace

double relativeError(const Image& image, const Image& reference,
                     const std::vector<std::string>& channels)
{
    double square = 0, mean = 0;
    for (const std::string& channel : channels) {
        const std::size_t a = indexOf(image, channel), b = indexOf(reference, channel);
        for (int y = 0; y < image.height; ++y)
            for (int x = 0; x < image.width; ++x) {
                const double difference = double(image.pixel(x, y)[a]) - reference.pixel(x, y)[b];
                square += difference * difference;
                mean += reference.pixel(x, y)[b];
            }
    }
    const double count = double(image.width) * image.height * double(channels.size());
    if (!(mean > 0))
        throw Error("the reference picture is black: the camera sees no lit volume, so there is "
                    "nothing to compare");
    return std::sqrt(square / count) / (mean / count);
}

std::string choiceTables(const std::vector<Result>& radiance,
                         const std::vector<Result>& transmittance)
{
    std::vector<ChartPoint> all, method, depth;
    for (const Result& r : radiance) {
        if (r.other_light) continue;
        all.push_back({r.row.name, r.cpu_seconds, r.error});
        if (r.method_error >= 0) method.push_back({r.row.name, r.cpu_seconds, r.method_error});
    }
    for (const Result& r : transmittance)
        depth.push_back({(r.row.family == "exact" ? "" : r.row.family + ", step ") + r.row.name,
                         r.cpu_seconds, r.error});
    return choiceTable("radiance, sampling included", all) + "\n"
        + choiceTable("radiance, the same rays as the reference", method) + "\n"
        + choiceTable("transmittance at pixel centres", depth) + otherLightTable(radiance);
}

std::string csvRows(const std::string& panel, const std::vector<Result>& results)
{
    std::string csv;
    for (const Result& r : results) {
        std::string settings; // quotation marks are doubled
        for (const char c : r.settings.dump()) settings += c == '"' ? "\"\"" : std::string(1, c);
        csv +=
            fmt::format("{},\"{}\",\"{}\",{:.4f},{:.6g},{},\"{}\"\n", panel, r.row.name,
                        r.row.family, r.cpu_seconds, r.error,
                        r.method_error < 0 ? "" : fmt::format("{:.6g}", r.method_error), settings);
    }
    return csv;
}

} // namespace volcomp
