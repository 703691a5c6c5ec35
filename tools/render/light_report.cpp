// SPDX-License-Identifier: Apache-2.0
#include "tools/render/light_report.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace volcomp {
namespace {

constexpr double kHardly = 0.01; ///< less of a light that arrives is worth a line

std::string nameOf(const std::vector<Light>& lights, std::size_t l)
{
    return lights[l].name.empty() ? fmt::format("light{}", l + 1) : lights[l].name;
}

/// A share in percent with two digits.
std::string percent(double share)
{
    return share >= 0.1 || share == 0 ? fmt::format("{:.0f} %", 100 * share)
                                      : fmt::format("{:.2g} %", 100 * share);
}

double rounded(double x) { return std::round(x * 1e4) / 1e4; }

} // namespace

std::vector<std::string> lightReport(const std::vector<Light>& lights, const RenderStats& stats)
{
    if (stats.rays == 0) return {};
    std::string shares;
    std::vector<std::string> lines;
    for (std::size_t l = 0; l < std::min(lights.size(), stats.lights.size()); ++l) {
        const LightShare& light = stats.lights[l];
        const std::string name = nameOf(lights, l);
        shares += fmt::format("{}{} {}", shares.empty() ? "" : ", ", name, percent(light.seen));
        if (light.arrives >= 0) shares += fmt::format(" ({} arrives)", percent(light.arrives));
        if (light.arrives < 0)
            lines.push_back("light '" + name + "' shines on nothing that the picture shows");
        else if (light.arrives < kHardly)
            lines.push_back(fmt::format(
                "{} of light '{}' arrives: something stands before it, or what it "
                "shines on lies deep in the shade of others",
                light.arrives > 0 ? "only " + percent(light.arrives) : "nothing", name));
    }
    if (stats.ambient_seen > 0)
        shares +=
            fmt::format("{}ambient {}", shares.empty() ? "" : ", ", percent(stats.ambient_seen));
    if (shares.empty()) return {};
    lines.insert(lines.begin(), "light seen: " + shares);
    return lines;
}

nlohmann::json lightStats(const std::vector<Light>& lights, const RenderStats& stats)
{
    nlohmann::json list = nlohmann::json::array();
    for (std::size_t l = 0; l < std::min(lights.size(), stats.lights.size()); ++l) {
        const LightShare& light = stats.lights[l];
        list.push_back(
            {{"name", nameOf(lights, l)},
             {"seen", rounded(light.seen)},
             {"arrives",
              light.arrives < 0 ? nlohmann::json() : nlohmann::json(rounded(light.arrives))}});
    }
    return {{"lights", list}, {"ambient", {{"seen", rounded(stats.ambient_seen)}}}};
}

} // namespace volcomp
