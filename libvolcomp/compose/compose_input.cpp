// SPDX-License-Identifier: Apache-2.0
#include "volcomp/compose/compose_input.h"

#include <cmath>

#include <fmt/format.h>

#include "volcomp/base/error.h"

namespace volcomp {

void checkComposeInput(std::size_t boxes, const PlacedScene& scene, const ComposeParams& params)
{
    params.validate();
    if (!(params.voxel > 0)) throw Error("compose: expected a voxel size > 0");
    for (const Placement& p : scene.boxes.placements) {
        if (p.box >= boxes)
            throw Error(fmt::format("compose: expected a box below {}, found {}", boxes, p.box));
        if (!(p.scale > 0 && std::isfinite(p.scale) && std::isfinite(p.position.lengthSqr())
              && std::isfinite(p.tint.lengthSqr())))
            throw Error(
                "compose: expected placements with finite positions and tints and a scale > 0");
        for (const Vec3f* axis : {&p.x_axis, &p.y_axis, &p.z_axis})
            if (!(std::abs(axis->lengthSqr() - 1) < 1e-3f))
                throw Error("compose: expected placements with axes of unit length");
    }
}

} // namespace volcomp
