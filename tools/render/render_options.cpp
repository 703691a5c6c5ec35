// SPDX-License-Identifier: Apache-2.0
#include "tools/render/render_options.h"

#include <charconv>
#include <cstdio>

#include "tools/shared/choice.h"
#include "volcomp/base/error.h"

namespace volcomp {

Pixel readPixel(const std::string& option, const std::string& text)
{
    Pixel pixel{};
    const char* end = text.data() + text.size();
    const auto x = std::from_chars(text.data(), end, pixel.x);
    if (x.ec == std::errc() && x.ptr != end && *x.ptr == ',') {
        const auto y = std::from_chars(x.ptr + 1, end, pixel.y);
        if (y.ec == std::errc() && y.ptr == end) return pixel;
    }
    throw Error(option + ": expected a pixel X,Y as two whole numbers, such as 320,240, found '"
                + text + "'");
}

RenderOptions::RenderOptions(CLI::App& app)
{
    const std::string scenes = " (default: the scene's)";
    app.add_option("--size", m_size, "Size of the picture, pixels" + scenes)->type_name("WxH");
    app.add_option("--crop", m_crop, "Render only this rectangle, pixels from the top left corner")
        ->type_name("X,Y,W,H");
    app.add_option("--samples", m_samples, "Samples per pixel" + scenes)
        ->check(CLI::Range(1, 65536));
    addChoice(app, "--pixel-filter", m_pixel_filter,
              "How the samples around a pixel are weighed" + scenes, kPixelFilterWords);
    app.add_option("--pixel-radius", m_pixel_radius, "Radius of that filter, pixels" + scenes)
        ->check(CLI::Range(0.0, 16.0));
    addChoice(app, "--shadows", m_shadows, "Light on its way to a voxel" + scenes, kShadowsWords);
    addChoice(app, "--integration", m_integration, "Closed form, or the paper's sums" + scenes,
              kIntegrationWords);
    app.add_option("--step", m_step, "Step of the sums, voxels" + scenes)
        ->check(CLI::Range(0.001, 1000.0));
    addChoice(app, "--filter", m_filter, "Density between voxel centres" + scenes, kFilterWords);
    addChoice(app, "--extinction", m_extinction,
              "Whether fibres seen end on and leaves seen from the edge cover less" + scenes,
              kExtinctionWords);
    app.add_option(
           "--cutoff", m_cutoff,
           "Rays end where a smaller fraction of light passes; no radiance is off by more than this fraction of the brightest voxel's"
               + scenes)
        ->check(CLI::Range(0.0, 0.99));
    app.add_flag_function(
        "--lod,!--no-lod", [this](std::int64_t n) { m_lod = n > 0; },
        "Coarser voxels where they are smaller than pixels" + scenes);
}

void RenderOptions::apply(RenderParams& params) const
{
    char rest = 0;
    if (!m_size.empty()
        && (std::sscanf(m_size.c_str(), "%dx%d%c", &params.width, &params.height, &rest) != 2
            || params.width < 1 || params.height < 1))
        throw Error("--size: expected WIDTHxHEIGHT in pixels, such as 640x480, found '" + m_size
                    + "'");
    Crop& c = params.crop;
    if (!m_crop.empty()
        && std::sscanf(m_crop.c_str(), "%d,%d,%d,%d%c", &c.x, &c.y, &c.width, &c.height, &rest)
            != 4)
        throw Error("--crop: expected X,Y,WIDTH,HEIGHT in pixels, such as 100,50,64,64, found '"
                    + m_crop + "'");
    params.samples = m_samples.value_or(params.samples);
    params.pixel_filter = m_pixel_filter.value_or(params.pixel_filter);
    params.pixel_radius = m_pixel_radius.value_or(params.pixel_radius);
    params.shadows = m_shadows.value_or(params.shadows);
    params.integration = m_integration.value_or(params.integration);
    params.step = m_step.value_or(params.step);
    params.filter = m_filter.value_or(params.filter);
    params.extinction = m_extinction.value_or(params.extinction);
    params.cutoff = m_cutoff.value_or(params.cutoff);
    params.lod = m_lod.value_or(params.lod);
}

} // namespace volcomp
