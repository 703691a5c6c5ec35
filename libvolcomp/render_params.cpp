#include "render_params.h"

#include "toml_reader.h"

namespace volcomp {

void RenderParams::validate() const {}

RenderParams readRender(TableReader& r)
{
    RenderParams p;
    p.width = r.integer({"width", "pixels", "of the picture"}, p.width, {1, 32768});
    p.height = r.integer({"height", "pixels", "of the picture"}, p.height, {1, 32768});
    p.samples = r.integer({"samples", "", "per pixel"}, p.samples, {1, 65536});
    p.tau = r.number({"tau", "", "extinction per density"}, p.tau, kNotNegative);
    p.integration = r.choice<Integration>({"integration", "", "closed form per voxel, or the paper's sums (3), (4)"}, p.integration,
                                          {{"exact", Integration::exact}, {"riemann", Integration::riemann}});
    p.step = r.number({"step", "voxels", "of the sums, riemann"}, p.step, {0.001, 1000});
    p.filter = r.choice<Filter>({"filter", "", "density between voxel centres"}, p.filter, {{"box", Filter::box}, {"trilinear", Filter::trilinear}});
    p.extinction = r.choice<Extinction>({"extinction", "", "fibre: a fibre covers less seen end on"}, p.extinction,
                                        {{"isotropic", Extinction::isotropic}, {"fibre", Extinction::fibre}});
    p.undirected = r.choice<Undirected>({"undirected", "", "how a voxel without direction is shaded"}, p.undirected,
                                        {{"isotropic", Undirected::isotropic}, {"gradient", Undirected::gradient}});
    p.background = r.colour({"background", "", "radiance behind everything"}, p.background);
    p.ambient = r.colour({"ambient", "", "radiance from all around"}, p.ambient);
    r.finish();
    return p;
}

} // namespace volcomp
