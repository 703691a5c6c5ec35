// SPDX-License-Identifier: Apache-2.0
#include "volcomp/scene/scene_dome.h"

#include <algorithm>

#include <fmt/format.h>

namespace volcomp {
namespace {

std::string freeName(const std::vector<Light>& lights)
{
    for (int number = 1;; ++number) {
        std::string name = number == 1 ? "sun" : fmt::format("sun{}", number);
        if (std::none_of(lights.begin(), lights.end(),
                         [&](const Light& l) { return l.name == name; }))
            return name;
    }
}

} // namespace

std::vector<std::string> loadSceneDome(Scene& scene)
{
    std::vector<std::string> sentences;
    for (Light& sun : loadDome(scene.render.dome)) {
        sun.name = freeName(scene.lights);
        const auto text = [](const Vec3d& v) {
            return fmt::format("({:.4g} {:.4g} {:.4g})", v[0], v[1], v[2]);
        };
        sentences.push_back(fmt::format(
            "{}: a sun in it shines as light '{}': direction {}, strength {}, disc_degrees {:.3g}",
            scene.render.dome.file.string(), sun.name, text(sun.direction), text(sun.strength),
            sun.disc / kDegree));
        scene.lights.push_back(std::move(sun));
    }
    return sentences;
}

} // namespace volcomp
