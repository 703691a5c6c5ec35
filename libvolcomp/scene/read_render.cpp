// SPDX-License-Identifier: Apache-2.0
#include "volcomp/scene/readers.h"

namespace volcomp {

RenderParams readRender(TableReader& r)
{
    RenderParams p;
    p.width = r.integer({"width", "pixels", "of the picture"}, p.width, {1, 32768});
    p.height = r.integer({"height", "pixels", "of the picture"}, p.height, {1, 32768});
    p.samples = r.integer({"samples", "", "per pixel"}, p.samples, {1, 65536});
    p.pixel_filter = r.choice<PixelFilter>(
        {"pixel_filter", "", "how the samples around a pixel are weighed if there are several"},
        p.pixel_filter, kPixelFilterWords);
    p.pixel_radius =
        r.number({"pixel_radius", "pixels", "of that filter; 0: 0.5 for box, 1.5 for the others"},
                 p.pixel_radius, {0, 16});
    p.tau = r.number({"tau", "", "extinction per density"}, p.tau, kNotNegative);
    p.integration = r.choice<Integration>(
        {"integration", "", "closed form per voxel, or the paper's sums (3), (4)"}, p.integration,
        kIntegrationWords);
    p.step = r.number({"step", "voxels", "of the sums, riemann"}, p.step, {0.001, 1000});
    p.filter =
        r.choice<Filter>({"filter", "", "density between voxel centres"}, p.filter, kFilterWords);
    p.extinction = r.choice<Extinction>(
        {"extinction", "", "directed: a fibre covers less seen end on, a leaf seen from its edge"},
        p.extinction, kExtinctionWords);
    p.shadows = r.choice<Shadows>(
        {"shadows", "",
         "light on its way to a voxel: rays for each shaded voxel and light; swept once through the volume (a pixel of fur is 2 % off, eleven times faster); or not weakened at all"},
        p.shadows, kShadowsWords);
    p.own_shade = r.choice<OwnShade>(
        {"own_shade", "",
         "left_out: a strand or leaf does not shade itself, as far as its box knows which particles are its own; counted: all particles shade"},
        p.own_shade, kOwnShadeWords);
    p.scattering = r.choice<Scattering>(
        {"scattering", "",
         "single: light is scattered once, as in the paper; multiple: any number of times, and fibres send out no more light than they take"},
        p.scattering, kScatteringWords);
    p.cutoff = r.number(
        {"cutoff", "",
         "a ray ends as soon as less than this fraction of light passes; bounds the error relative to the brightest voxel"},
        p.cutoff, {0, 0.99});
    p.lod = r.flag(
        {"lod", "",
         "level of detail: where voxels are smaller than pixels, coarser ones that keep the mean transmittance; in fur 8 voxels a pixel wide one sample is closer than four without, and 1 % too dark"},
        p.lod);
    p.undirected =
        r.choice<Undirected>({"undirected", "", "how a voxel without direction is shaded"},
                             p.undirected, kUndirectedWords);
    p.light_samples = r.integer(
        {"light_samples", "",
         "hard lights that a light with disc_degrees or radius stands for: more make its shadows' borders smoother and light takes longer to sweep; with samples = 1 its middle alone"},
        p.light_samples, {1, 256});
    p.aovs = r.flag(
        {"aovs", "",
         "write depth (Z), normal (N), albedo, each light's share and those of ambient, background and haze to the EXR; weighted by what shows, as R, G, B are by alpha"},
        p.aovs);
    p.background = r.colour({"background", "", "radiance behind everything"}, p.background);
    p.ambient = r.colour({"ambient", "", "radiance from all around"}, p.ambient);
    r.finish();
    return p;
}

} // namespace volcomp
