#include "volcomp/volume/material.h"

#include "volcomp/scene/toml_reader.h"
#include "volcomp/base/error.h"

namespace volcomp {

void Material::validate() const
{
    const bool colour_ok = std::isfinite(specular_colour.lengthSqr()) && specular_colour[0] >= 0
        && specular_colour[1] >= 0 && specular_colour[2] >= 0;
    if (!(alpha >= 0 && beta >= 0 && gamma >= 0 && n > 0 && std::isfinite(alpha + beta + gamma + n)
          && colour_ok))
        throw Error("material '" + name
                    + "': expected finite alpha, beta, gamma, specular_colour >= 0 and n > 0");
}

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
    r.finish();
    m.validate();
    return m;
}

} // namespace volcomp
