// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/soft_lights.h"

#include <algorithm>

#include "volcomp/base/random.h"
#include "volcomp/view/soft_light.h"

namespace volcomp {

SoftLights::SoftLights(const std::vector<Light>& lights, const RenderParams& params)
    : m_scene_lights(lights)
{
    const bool soft = params.samples > 1
        && std::any_of(lights.begin(), lights.end(), [](const Light& l) { return l.isSoft(); });
    const std::size_t parts = soft ? std::size_t(params.light_samples) : 1;
    m_numbers.assign(parts, std::vector<std::size_t>(lights.size()));
    std::vector<std::vector<Light>> hard;
    for (std::size_t l = 0; l < lights.size(); ++l) {
        hard.push_back(hardLights(lights[l], int(parts)));
        m_all.push_back(hard[l][0]);
        m_numbers[0][l] = l;
    }
    for (std::size_t part = 1; part < parts; ++part)
        for (std::size_t l = 0; l < lights.size(); ++l) {
            m_numbers[part][l] = lights[l].isSoft() ? m_all.size() : l;
            if (lights[l].isSoft()) m_all.push_back(hard[l][part]);
        }
}

std::vector<Light> SoftLights::lights(int part) const
{
    std::vector<Light> result;
    result.reserve(m_scene_lights.size());
    for (std::size_t l = 0; l < m_scene_lights.size(); ++l) {
        const Light& hard = m_all[numbers(part)[l]];
        result.push_back(parts() > 1 ? shareOf(hard, m_scene_lights[l], parts()) : hard);
    }
    return result;
}

int lightPart(int x, int y, int s, int samples, int parts)
{
    if (parts == 1) return 0;
    if (samples >= parts) { // each pixel begins with another one
        const std::uint64_t key = mix64((std::uint64_t(std::uint32_t(x)) << 32) + std::uint32_t(y));
        return int((key % std::uint64_t(parts) + std::uint64_t(s)) % std::uint64_t(parts));
    }
    // The pixels of a group share the parts among themselves, each taking every `group`th.
    const int group = (parts + samples - 1) / samples;
    return ((x + 2 * y) % group + s * group) % parts;
}

} // namespace volcomp
