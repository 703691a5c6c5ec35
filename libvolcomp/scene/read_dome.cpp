// SPDX-License-Identifier: Apache-2.0
#include "volcomp/scene/readers.h"

namespace volcomp {

Dome readDome(TableReader& r)
{
    Dome d;
    d.kind = r.choice<DomeKind>(
        {"kind", "", "the same everywhere, by the height over the horizon, or a lat-long image"},
        d.kind, kDomeKindWords);
    d.colour = r.colour({"colour", "", "constant: radiance"}, d.colour);
    d.zenith = r.colour({"zenith", "", "gradient: radiance straight up"}, d.zenith);
    d.horizon = r.colour({"horizon", "", "gradient: radiance at the horizon"}, d.horizon);
    d.ground = r.colour({"ground", "", "gradient: radiance from below the horizon"}, d.ground);
    d.file = r.path(
        {"image", "",
         "image: of colours, all around, twice as wide as high; its middle looks along -z, u = 0 along +z, the right half towards +x; a sun in it becomes a light of its own"},
        "");
    r.require((d.kind == DomeKind::image) != d.file.empty(), "image",
              d.file.empty() ? "the path of an image, as kind = \"image\" needs one"
                             : "no image, or kind = \"image\"");
    d.rotate = kDegree
        * r.number({"rotate_degrees", "degrees", "image: turns it around +y, from -z towards +x"},
                   0, {-3600, 3600});
    d.strength = r.number({"strength", "", "factor on all of it"}, d.strength, kNotNegative);
    d.visible =
        r.flag({"visible", "", "it is seen behind everything, instead of background"}, d.visible);
    r.finish();
    return d;
}

} // namespace volcomp
