// The options of volcomp-render that stand for keys of the scene's [render] table.
#pragma once

#include <optional>
#include <string>

#include <CLI/CLI.hpp>

#include "volcomp/render/render_params.h"

namespace volcomp {

class RenderOptions {
public:
    /// Adds the options; this object must outlive the parsing.
    explicit RenderOptions(CLI::App& app);

    /// Sets what was given on the command line. Throws Error for a size or a crop that cannot be
    /// read.
    void apply(RenderParams& params) const;

private:
    std::string m_size, m_crop;
    std::optional<int> m_samples;
    std::optional<PixelFilter> m_pixel_filter;
    std::optional<Shadows> m_shadows;
    std::optional<Integration> m_integration;
    std::optional<Filter> m_filter;
    std::optional<Extinction> m_extinction;
    std::optional<double> m_pixel_radius, m_step, m_cutoff;
    std::optional<bool> m_lod;
};

} // namespace volcomp
