// SPDX-License-Identifier: Apache-2.0
#include "tools/chart/other_light.h"

#include <fmt/format.h>

#include "tools/shared/even_dome.h"

namespace volcomp {

void OtherLight::apply(Scene& scene) const
{
    scene.render.scattering = scattering.value_or(scene.render.scattering);
    applyEvenDome(scene.render, dome);
}

std::vector<std::string> OtherLight::options() const
{
    std::vector<std::string> options;
    if (scattering)
        options.insert(options.end(), {"--scattering", wordOf(kScatteringWords, *scattering)});
    if (dome) options.insert(options.end(), {"--dome", fmt::format("{:g}", *dome)});
    return options;
}

nlohmann::json OtherLight::key() const
{
    nlohmann::json key;
    if (!own()) key = options();
    return key;
}

std::vector<OtherLight> otherLights(const Scene& scene)
{
    constexpr double kDome = 0.5;
    const Scattering other =
        scene.render.scattering == Scattering::single ? Scattering::multiple : Scattering::single;
    std::vector<OtherLight> lights{{wordOf(kScatteringWords, other), other, {}}};
    const bool around = scene.render.ambient != Vec3d(0.0) || !scene.render.dome.black();
    if (!around) lights.push_back({"dome", {}, kDome});
    else if (!scene.lights.empty()) lights.push_back({"no_dome", {}, 0.0});
    return lights;
}

} // namespace volcomp
