// SPDX-License-Identifier: Apache-2.0
// The option --dome of the programs that make pictures.
#pragma once

#include <optional>

#include <CLI/CLI.hpp>

#include "tools/shared/numbers.h"
#include "volcomp/render/render_params.h"

namespace volcomp {

/// Adds the option, which sets `radiance`.
inline void addEvenDome(CLI::App& app, std::optional<double>& radiance)
{
    app.add_option("--dome", radiance,
                   "Even light of this radiance from all around, unseen, instead of the scene's "
                   "dome (with the suns of its image) and ambient light; 0: none")
        ->check(realNumber(0, 1e6));
}

/// Sets what was given. Call it before loadSceneDome(), which makes lights of an image's suns.
inline void applyEvenDome(RenderParams& params, const std::optional<double>& radiance)
{
    if (!radiance) return;
    params.ambient = Vec3d(0.0);
    params.dome = {};
    params.dome.colour = Vec3d(*radiance);
    params.dome.visible = false;
}

} // namespace volcomp
