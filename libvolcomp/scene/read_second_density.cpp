// SPDX-License-Identifier: Apache-2.0
#include "volcomp/scene/readers.h"

namespace volcomp {

namespace {

MapFactor readFactor(TableReader& t, bool colour)
{
    MapFactor m;
    m.image = t.path(
        {"image", "",
         colour
             ? "image file of colours, which become linear RGB by what the file says (integers are sRGB, floats linear if it says nothing); several factors multiply"
             : "image file of data: its numbers are taken as they are, never converted from sRGB; several factors multiply"},
        "");
    m.channel = t.integer(
        {"channel", "", "of the image, from 0; -1: luminance, or red, green and blue for a colour"},
        m.channel, {-1, 1000});
    m.wrap = t.choice<Wrap>({"wrap", "", "the image outside of the unit square of (u,v)"}, m.wrap,
                            {{"repeat", Wrap::repeat},
                             {"clamp", Wrap::clamp},
                             {"mirror", Wrap::mirror},
                             {"black", Wrap::black}});
    const auto repeat = t.numbers(
        {"repeat", "", "[across, up]: how often the image stands in the unit square of (u,v)"},
        {1, 1}, {-1e6, 1e6});
    t.require(repeat.size() == 2, "repeat", "two numbers");
    if (repeat.size() == 2) m.repeat = Vec2d(repeat[0], repeat[1]);
    m.noise = t.number({"noise", "m", "size of the features of noise in the world; 0: no noise"},
                       m.noise, kNotNegative);
    m.octaves = t.integer(
        {"octaves", "", "of the noise, each half as large and half as strong as the one before"},
        m.octaves, {1, 16});
    m.seed = t.seed({"seed", "", "of the noise"}, m.seed);
    if (colour)
        m.constant = t.colour({"constant", "", "a colour, if neither an image nor noise is given"},
                              m.constant);
    else
        m.constant =
            Vec3d(t.number({"constant", "", "a number, if neither an image nor noise is given"},
                           m.constant[0], kAny));
    const auto range = t.numbers(
        {"range", "", "[at 0, at 1]: what 0 and 1 of the image or noise become; [1, 0] inverts"},
        {0, 1}, kAny);
    t.require(range.size() == 2, "range", "two numbers");
    if (range.size() == 2) m.low = range[0], m.high = range[1];
    t.require(m.image.empty() || m.noise == 0, "noise",
              "an image or noise, not both in one factor");
    t.finish();
    t.check([&] { m.validate(); });
    return m;
}

} // namespace

std::vector<MapFactor> readMaps(TableReader& r, const char* name, const char* meaning, bool colour)
{
    std::vector<MapFactor> maps;
    for (TableReader& t : r.tables({name, "", meaning})) maps.push_back(readFactor(t, colour));
    // Described factors are no factors: the default of the list is an empty one.
    return r.isDescribing() ? std::vector<MapFactor>{} : maps;
}

} // namespace volcomp
