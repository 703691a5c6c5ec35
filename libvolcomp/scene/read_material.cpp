// SPDX-License-Identifier: Apache-2.0
#include "volcomp/scene/readers.h"

namespace volcomp {

Material readMaterial(TableReader& r, const std::string& name)
{
    Material m;
    m.name = name;
    m.kind = r.choice<MaterialKind>(
        {"kind", "", "reflection model: a fibre has a tangent, a surface a normal"}, m.kind,
        {{"fibre", MaterialKind::fibre}, {"surface", MaterialKind::surface}});
    m.alpha = r.number({"alpha", "", "weight of the diffuse (body) reflection"}, m.alpha, {0, 10});
    m.beta = r.number({"beta", "", "weight of the specular reflection"}, m.beta, {0, 100});
    m.gamma = kDegree
        * r.number(
            {"gamma_degrees", "degrees",
             "half width at half maximum of the highlight; for the same look a fibre takes twice a surface's"},
            12, {0.06, 90});
    m.n = r.number({"n", "", "refractive index"}, m.n, {0.1, 10});
    m.specular_colour = r.colour({"specular_colour", "", "colour of the specular reflection, e"},
                                 m.specular_colour);
    m.transmission = r.colour(
        {"transmission", "",
         "surface: factor on the voxel's colour that light from the other side is seen with; alpha + transmission <= 1"},
        m.transmission);
    r.finish();
    r.check([&] { m.validate(); });
    return m;
}

} // namespace volcomp
