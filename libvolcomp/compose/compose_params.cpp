// SPDX-License-Identifier: Apache-2.0
#include "volcomp/compose/compose_params.h"

#include <cmath>

#include "volcomp/base/error.h"

namespace volcomp {

void ComposeParams::validate() const
{
    if (!(voxel >= 0 && std::isfinite(voxel))) throw Error("compose: expected a voxel size >= 0");
    if (!(voxel_pixels > 0 && std::isfinite(voxel_pixels)))
        throw Error("compose: expected voxel_pixels > 0");
    if (!(minimum_density >= 0)) throw Error("compose: expected a minimum density >= 0");
    if (!(minimum_depth >= 0)) throw Error("compose: expected a minimum optical depth >= 0");
}

} // namespace volcomp
