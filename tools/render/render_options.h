// SPDX-License-Identifier: Apache-2.0
// The options of volcomp-render that stand for keys of the scene's [render] and [picture] tables,
// and its pixels.
#pragma once

#include <optional>
#include <string>

#include <CLI/CLI.hpp>

#include "volcomp/render/render_params.h"
#include "volcomp/view/tone.h"

namespace volcomp {

/// A pixel of the whole picture, counted from its top left corner.
struct Pixel {
    int x, y;
};

/// Reads X,Y, the value of `option`. Throws Error if it is anything but two whole numbers.
Pixel readPixel(const std::string& option, const std::string& text);

/// The options of a render, and which of them were given.
class RenderOptions {
public:
    /// Adds the options; this object must outlive the parsing.
    explicit RenderOptions(CLI::App& app);

    /// Sets what was given on the command line. Throws Error if a size or a crop cannot be read, or
    /// has no pixel.
    void apply(RenderParams& params) const;
    void apply(Look& look) const;

private:
    std::string m_size, m_crop;
    std::optional<int> m_samples, m_light_samples;
    std::optional<PixelFilter> m_pixel_filter;
    std::optional<Shadows> m_shadows;
    std::optional<Integration> m_integration;
    std::optional<Filter> m_filter;
    std::optional<Extinction> m_extinction;
    std::optional<OwnShade> m_own_shade;
    std::optional<Scattering> m_scattering;
    std::optional<double> m_pixel_radius, m_step, m_cutoff, m_exposure, m_dome;
    std::optional<Tone> m_tone;
    std::optional<bool> m_lod;
    bool m_background = true;
};

} // namespace volcomp
