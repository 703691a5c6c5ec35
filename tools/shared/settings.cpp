// SPDX-License-Identifier: Apache-2.0
#include "tools/shared/settings.h"

namespace volcomp {

nlohmann::json settingsOf(const RenderParams& p)
{
    const auto colour = [](const Vec3d& c) { return nlohmann::json{c[0], c[1], c[2]}; };
    return {{"width", p.width},
            {"height", p.height},
            {"crop", {p.crop.x, p.crop.y, p.crop.width, p.crop.height}},
            {"samples", p.samples},
            {"pixel_filter", wordOf(kPixelFilterWords, p.pixel_filter)},
            {"pixel_radius", p.pixel_radius},
            {"tau", p.tau},
            {"step", p.step},
            {"cutoff", p.cutoff},
            {"lod", p.lod},
            {"integration", wordOf(kIntegrationWords, p.integration)},
            {"filter", wordOf(kFilterWords, p.filter)},
            {"extinction", wordOf(kExtinctionWords, p.extinction)},
            {"shadows", wordOf(kShadowsWords, p.shadows)},
            {"own_shade", wordOf(kOwnShadeWords, p.own_shade)},
            {"scattering", wordOf(kScatteringWords, p.scattering)},
            {"undirected", wordOf(kUndirectedWords, p.undirected)},
            {"light_samples", p.light_samples},
            {"haze",
             {{"colour", colour(p.haze.colour)},
              {"density", p.haze.density},
              {"height", p.haze.height},
              {"base", p.haze.base}}},
            {"aovs", p.aovs},
            {"background", colour(p.background)},
            {"ambient", colour(p.ambient)}};
}

nlohmann::json lookOf(const Look& look)
{
    return {{"exposure", look.exposure}, {"tone", wordOf(kToneWords, look.tone)}};
}

} // namespace volcomp
