// SPDX-License-Identifier: Apache-2.0
#include "volcomp/volume/material.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

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
    const double most = std::max({transmission[0], transmission[1], transmission[2]});
    if (!(transmission[0] >= 0 && transmission[1] >= 0 && transmission[2] >= 0
          && std::isfinite(most)))
        throw Error("material '" + name + "': expected a finite transmission >= 0");
    if (!(most > 0)) return;
    if (kind != MaterialKind::surface)
        throw Error("material '" + name
                    + "': expected no transmission, as only surfaces have two sides");
    if (alpha + most > 1 + 1e-9)
        throw Error(fmt::format(
            "material '{}': expected alpha + transmission <= 1, as a leaf sends out no more light than it takes, found {:g} + {:g}",
            name, alpha, most));
}

} // namespace volcomp
