// SPDX-License-Identifier: Apache-2.0
// Other light than a scene has, under which volcomp-chart measures it as well.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "volcomp/scene/scene.h"

namespace volcomp {

/// What is other than in the scene. Pictures under one light are compared with references under the
/// same light alone: `single` and `multiple` are not the same brightness, nor is one an error of
/// the other.
struct OtherLight {
    std::string name; ///< for people and for names of files; empty: the scene's own light
    std::optional<Scattering> scattering;
    std::optional<double> dome; ///< radiance of an even dome instead of the scene's and of ambient

    bool own() const { return name.empty(); }
    /// Changes a scene whose dome is not loaded.
    void apply(Scene& scene) const;
    /// What makes volcomp-render and volcomp-truth show it.
    std::vector<std::string> options() const;
    /// What its pictures depend on; null for the scene's own light.
    nlohmann::json key() const;
};

/// Returns the scattering that the scene does not have ("single" or "multiple"), and an even dome
/// of half the brightness of a light of strength 1 that shines on a white wall ("dome"); for a
/// scene with light from all around none of it ("no_dome"), if it has other light.
std::vector<OtherLight> otherLights(const Scene& scene);

} // namespace volcomp
