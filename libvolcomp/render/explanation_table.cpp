// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include <fmt/format.h>

#include "volcomp/render/explain.h"

namespace volcomp {
namespace {

std::string text(const Vec3d& v) { return fmt::format("({:.6g} {:.6g} {:.6g})", v[0], v[1], v[2]); }
std::string text(const openvdb::Coord& c) { return fmt::format("({} {} {})", c[0], c[1], c[2]); }

std::string nameOf(const std::vector<Light>& lights, std::size_t l)
{
    return lights[l].name.empty() ? fmt::format("light{}", l + 1) : lights[l].name;
}

std::string text(const ExplainedPart& part, bool several_voxels)
{
    std::string line =
        fmt::format("      {}", part.material.empty() ? "(no material)" : part.material);
    if (several_voxels) line += " in " + text(part.voxel);
    line += fmt::format(": density {:.6g}, share {:.6g}", part.density, part.share);
    if (part.directed)
        line += fmt::format(", {} {}, spread {:.3g}",
                            part.kind == MaterialKind::fibre ? "tangent" : "normal",
                            text(part.direction), part.spread);
    else line += ", no direction";
    return line + ", colour " + text(part.colour) + "\n";
}

std::string text(const ExplainedLight& light, const std::vector<Light>& lights)
{
    std::string lines =
        fmt::format("      {}: strength {}, reflected {},\n"
                    "        transmittance {:.6g} (depth {:.6g}), adds {}\n",
                    nameOf(lights, light.light), text(light.strength), text(light.reflected),
                    light.transmittance, -std::log(light.transmittance), text(light.adds));
    if (light.scattered != Vec3d(0.0))
        lines += "        scattered more than once, adds " + text(light.scattered) + "\n";
    return lines;
}

std::string text(const ExplainedInterval& interval, std::size_t number,
                 const std::vector<Light>& lights)
{
    std::string lines =
        fmt::format("{:>4} {:>3} {:<20} {:>12.8g} {:>12.8g} {:>12.6g} {:>12.6g} {:>12.6g}\n",
                    number, interval.level, text(interval.voxel), interval.begin, interval.end,
                    interval.depth, interval.transmittance, interval.weight);
    bool several_voxels = false;
    for (const ExplainedPart& part : interval.parts)
        several_voxels |= part.voxel != interval.parts[0].voxel;
    for (const ExplainedPart& part : interval.parts) lines += text(part, several_voxels);
    for (const ExplainedLight& light : interval.lights) lines += text(light, lights);
    if (interval.ambient != Vec3d(0.0))
        lines += "      ambient: adds " + text(interval.ambient) + "\n";
    return lines;
}

std::string text(const ExplainedSkin& skin, const std::vector<Light>& lights)
{
    std::string lines =
        fmt::format("the ray ends at {:.8g} on the skin of surface '{}' ({}), transmitted {:.6g}\n"
                    "      at {}, normal {}, colour {}\n",
                    skin.distance, skin.surface, skin.material, skin.transmittance,
                    text(skin.position), text(skin.normal), text(skin.colour));
    for (const ExplainedLight& light : skin.lights) lines += text(light, lights);
    if (skin.ambient != Vec3d(0.0)) lines += "      ambient: adds " + text(skin.ambient) + "\n";
    return lines;
}

} // namespace

std::string explanationTable(const RayExplanation& e, const std::vector<Light>& lights)
{
    std::string table = fmt::format("pixel {},{}: ray from {} along {}\n", e.x, e.y, text(e.origin),
                                    text(e.direction));
    table += fmt::format("{:>4} {:>3} {:<20} {:>12} {:>12} {:>12} {:>12} {:>12}\n", "no.", "lod",
                         "voxel", "from", "to", "depth", "transmitted", "weight");
    for (std::size_t i = 0; i < e.intervals.size(); ++i)
        table += text(e.intervals[i], i + 1, lights);
    if (e.intervals.empty()) table += "  the ray meets no particles\n";
    if (e.skin) table += text(*e.skin, lights);
    table += "sums\n";
    for (std::size_t l = 0; l < e.light_sums.size(); ++l)
        table += fmt::format("  {:<14} {}\n", nameOf(lights, l), text(e.light_sums[l]));
    table += fmt::format("  {:<14} {}\n", "ambient", text(e.ambient));
    table += fmt::format("  {:<14} {}, through transmittance {:.6g}\n", "background",
                         text(e.background), e.transmittance);
    if (e.haze != Vec3d(0.0)) table += fmt::format("  {:<14} {}\n", "haze", text(e.haze));
    table += fmt::format("  {:<14} {}, alpha {:.6g}\n", "pixel", text(e.radiance), e.alpha);
    return table;
}

} // namespace volcomp
