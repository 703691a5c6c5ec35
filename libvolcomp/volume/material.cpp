// SPDX-License-Identifier: Apache-2.0
#include "volcomp/volume/material.h"

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

} // namespace volcomp
