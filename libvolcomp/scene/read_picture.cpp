// SPDX-License-Identifier: Apache-2.0
// What lies between the scene and who looks at it: haze, exposure, tone.
#include "volcomp/scene/readers.h"

namespace volcomp {

Haze readHaze(TableReader& r)
{
    Haze h;
    h.colour = r.colour({"colour", "", "radiance that very much of it shows"}, h.colour);
    h.density = r.number(
        {"density", "1/m", "at the height base: 0.01 hides 63 % of what is 100 m away; 0: no haze"},
        h.density, kNotNegative);
    h.height = r.number(
        {"height", "m", "over which the density falls to 37 %, upwards; 0: the same everywhere"},
        h.height, kNotNegative);
    h.base = r.number({"base", "m", "y at which it has its density"}, h.base, kAny);
    r.finish();
    return h;
}

Look readLook(TableReader& r)
{
    Look look;
    look.exposure = r.number({"exposure", "stops", "+1 shows everything twice as bright"},
                             look.exposure, {-100, 100});
    look.tone = r.choice<Tone>(
        {"tone", "",
         "filmic: highlights roll off, white is at 3.8 instead of 1, mid grey (0.18) and what is darker stay"},
        look.tone, kToneWords);
    r.finish();
    return look;
}

} // namespace volcomp
