// SPDX-License-Identifier: Apache-2.0
// Lights that have a size, split into parts: each sample of a pixel sees by one part of every light
// (MODEL section 4).
#pragma once

#include <cstddef>
#include <vector>

#include "volcomp/render/render_params.h"
#include "volcomp/view/light.h"

namespace volcomp {

/// The hard lights that a scene's lights stand for. A part has one for each of the scene's lights,
/// in their order; hard lights are in every part.
class SoftLights {
public:
    /// There are RenderParams::light_samples parts if a light is soft and pixels have more than one
    /// sample; otherwise one, in which soft lights are as their middles.
    SoftLights(const std::vector<Light>& lights, const RenderParams& params);

    int parts() const { return static_cast<int>(m_numbers.size()); }
    /// All hard lights, each once. The first are those of part 0, in order.
    const std::vector<Light>& all() const { return m_all; }
    /// The numbers in all() of the lights of a part.
    const std::vector<std::size_t>& numbers(int part) const
    {
        return m_numbers[static_cast<std::size_t>(part)];
    }
    /// With the sizes of their shares, shareOf(), if there are several parts.
    std::vector<Light> lights(int part) const;

private:
    std::vector<Light> m_scene_lights, m_all;
    std::vector<std::vector<std::size_t>> m_numbers; ///< by part and light
};

/// The part of the soft lights by which sample `s` of the pixel in column x and row y of the whole
/// picture sees. Any `parts` samples of a pixel that follow one another see all of them; if a pixel
/// has fewer samples, pixels beside each other see what it does not.
int lightPart(int x, int y, int s, int samples, int parts);

} // namespace volcomp
