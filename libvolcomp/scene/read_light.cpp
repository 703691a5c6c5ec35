// SPDX-License-Identifier: Apache-2.0
#include "volcomp/scene/readers.h"

#include <string_view>

namespace volcomp {
namespace {

/// Whether a light's own picture, NAME.R, NAME.G and NAME.B, would have the name of another part of
/// the EXR: TileRenderer's channels, and what programs that show an EXR take for them.
bool isChannel(std::string_view name)
{
    for (const std::string_view channel : {"R", "G", "B", "A", "Z", "N", "albedo", "rgb", "rgba",
                                           "alpha", "depth", "ambient", "background", "haze"})
        if (name == channel) return true;
    return false;
}

} // namespace

Light readLight(TableReader& r, int index)
{
    Light l;
    l.name = r.name({"name", "", "of the light's own picture in the EXR"},
                    "light" + std::to_string(index + 1));
    r.require(!isChannel(l.name), "name",
              "a name that no channel of the picture has, such as \"key\"");
    l.kind = r.choice<LightKind>(
        {"kind", "",
         "kind of light; patch: a small flat lamp, with the cosine of the angle from its direction"},
        l.kind,
        {{"directional", LightKind::directional},
         {"point", LightKind::point},
         {"spot", LightKind::spot},
         {"patch", LightKind::patch}});
    l.direction =
        r.direction({"direction", "", "the way the light travels; all but point"}, l.direction);
    l.position = r.vector({"position", "m", "all but directional"}, l.position);
    l.strength =
        r.colour({"strength", "",
                  "what a white diffuse surface that faces it shows; all but directional: at 1 m"},
                 l.strength);
    l.angle = kDegree
        * r.number({"angle_degrees", "degrees", "spot: from its axis to where it is dark"}, 30,
                   {0.01, 90});
    l.soft_angle = kDegree
        * r.number(
            {"soft_angle_degrees", "degrees", "spot: width of the soft border inside the angle"}, 3,
            {0, 90});
    l.disc = kDegree
        * r.number(
            {"disc_degrees", "degrees",
             "directional: the whole angle of the disc that it shines from, for soft shadows; the sun's is 0.53"},
            0, {0, 90});
    l.radius =
        r.number({"radius", "m",
                  "all but directional: of the ball or the disc that shines, for soft shadows"},
                 l.radius, kNotNegative);
    r.finish();
    return l;
}

} // namespace volcomp
