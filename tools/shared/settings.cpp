// SPDX-License-Identifier: Apache-2.0
#include "tools/shared/settings.h"

#include <cmath>

namespace volcomp {

namespace {

nlohmann::json colour(const Vec3d& c) { return {c[0] + 0.0, c[1] + 0.0, c[2] + 0.0}; } // -0 is 0

/// An angle as scene files have it, without the last digits, which the conversion leaves.
double degrees(double radians) { return std::round(radians / kDegree * 1e9) / 1e9; }

/// What counts of a dome; none is null.
nlohmann::json settingsOf(const Dome& d)
{
    if (d.black()) return nullptr;
    nlohmann::json settings = {
        {"kind", wordOf(kDomeKindWords, d.kind)}, {"strength", d.strength}, {"visible", d.visible}};
    switch (d.kind) {
    case DomeKind::constant:
        settings["colour"] = colour(d.colour);
        break;
    case DomeKind::gradient:
        settings["zenith"] = colour(d.zenith);
        settings["horizon"] = colour(d.horizon);
        settings["ground"] = colour(d.ground);
        break;
    case DomeKind::image:
        settings["image"] = d.file.string();
        settings["rotate_degrees"] = d.rotate / kDegree;
        break;
    }
    return settings;
}

} // namespace

nlohmann::json settingsOf(const RenderParams& p)
{
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
            {"ambient", colour(p.ambient)},
            {"dome", settingsOf(p.dome)}};
}

nlohmann::json settingsOf(const Camera& c)
{
    nlohmann::json settings = {
        {"eye", colour(c.eye)}, {"target", colour(c.target)}, {"up", colour(c.up)}};
    if (c.projection == Projection::perspective)
        settings["field_of_view_degrees"] = degrees(c.field_of_view);
    else settings["width"] = c.width;
    return settings;
}

nlohmann::json settingsOf(const Light& l)
{
    constexpr const char* kKinds[] = {"directional", "point", "spot", "patch"};
    return {{"name", l.name},
            {"kind", kKinds[std::size_t(l.kind)]},
            {"direction", colour(l.direction)},
            {"position", colour(l.position)},
            {"strength", colour(l.strength)},
            {"angle_degrees", degrees(l.angle)},
            {"soft_angle_degrees", degrees(l.soft_angle)},
            {"disc_degrees", degrees(l.disc)},
            {"radius", l.radius}};
}

nlohmann::json settingsOf(const Material& m)
{
    return {{"name", m.name},
            {"kind", m.kind == MaterialKind::fibre ? "fibre" : "surface"},
            {"alpha", m.alpha},
            {"beta", m.beta},
            {"gamma_degrees", degrees(m.gamma)},
            {"n", m.n},
            {"specular_colour", colour(m.specular_colour)},
            {"transmission", colour(m.transmission)}};
}

nlohmann::json lookOf(const Look& look)
{
    return {{"exposure", look.exposure}, {"tone", wordOf(kToneWords, look.tone)}};
}

} // namespace volcomp
