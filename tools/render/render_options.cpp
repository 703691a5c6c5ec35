// SPDX-License-Identifier: Apache-2.0
#include "tools/render/render_options.h"

#include <algorithm>
#include <vector>

#include "tools/shared/choice.h"
#include "tools/shared/even_dome.h"
#include "tools/shared/numbers.h"
#include "volcomp/base/error.h"

namespace volcomp {

namespace {

/// Reads `count` whole numbers with the character `between` between them. Throws Error "OPTION:
/// expected EXPECTED, found 'TEXT'" for anything else.
std::vector<int> wholeNumbers(const std::string& option, const std::string& text, char between,
                              std::size_t count, const std::string& expected)
{
    std::vector<int> numbers;
    for (std::size_t at = 0; at <= text.size();) {
        const std::size_t end = std::min(text.find(between, at), text.size());
        numbers.push_back(readWhole(option, text.substr(at, end - at), expected, text));
        at = end + 1;
    }
    if (numbers.size() != count)
        throw Error(option + ": expected " + expected + ", found '" + text + "'");
    return numbers;
}

} // namespace

Pixel readPixel(const std::string& option, const std::string& text)
{
    const std::vector<int> xy =
        wholeNumbers(option, text, ',', 2, "a pixel X,Y as two whole numbers, such as 320,240");
    return {xy[0], xy[1]};
}

RenderOptions::RenderOptions(CLI::App& app)
{
    const std::string scenes = " (default: the scene's)";
    app.add_option("--size", m_size, "Size of the picture, pixels" + scenes)->type_name("WxH");
    app.add_option("--crop", m_crop, "Render only this rectangle, pixels from the top left corner")
        ->type_name("X,Y,W,H");
    app.add_option("--samples", m_samples, "Samples per pixel" + scenes)
        ->check(wholeNumber(1, 65536));
    addChoice(app, "--pixel-filter", m_pixel_filter,
              "How the samples around a pixel are weighed" + scenes, kPixelFilterWords);
    app.add_option("--pixel-radius", m_pixel_radius, "Radius of that filter, pixels" + scenes)
        ->check(realNumber(0, 16));
    addChoice(app, "--shadows", m_shadows, "Light on its way to a voxel" + scenes, kShadowsWords);
    addChoice(app, "--integration", m_integration, "Closed form, or the paper's sums" + scenes,
              kIntegrationWords);
    app.add_option("--step", m_step, "Step of the sums, voxels" + scenes)
        ->check(realNumber(0.001, 1000));
    addChoice(app, "--filter", m_filter, "Density between voxel centres" + scenes, kFilterWords);
    addChoice(app, "--extinction", m_extinction,
              "Whether fibres seen end on and leaves seen from the edge cover less" + scenes,
              kExtinctionWords);
    addChoice(app, "--own-shade", m_own_shade, "Whether a strand's own particles shade it" + scenes,
              kOwnShadeWords);
    addChoice(app, "--scattering", m_scattering,
              "Whether light is scattered once or any number of times" + scenes, kScatteringWords);
    addEvenDome(app, m_dome);
    app.add_option(
           "--cutoff", m_cutoff,
           "Rays end where a smaller fraction of light passes; no radiance is off by more than this fraction of the brightest voxel's"
               + scenes)
        ->check(realNumber(0, 0.99));
    app.add_option("--light-samples", m_light_samples,
                   "Hard lights that a soft one stands for" + scenes)
        ->check(wholeNumber(1, 256));
    app.add_option("--exposure", m_exposure,
                   "Of PNG and previews, stops: +1 is twice as bright" + scenes)
        ->check(realNumber(-100, 100));
    addChoice(app, "--tone", m_tone, "How PNG and previews show what is bright" + scenes,
              kToneWords);
    app.add_flag(
        "!--no-background", m_background,
        "Nothing behind the volume: black there, and alpha 0, whatever the scene says; a dome "
        "still shines");
    app.add_flag_function(
        "--lod,!--no-lod", [this](std::int64_t n) { m_lod = n > 0; },
        "Coarser voxels where they are smaller than pixels" + scenes);
}

void RenderOptions::apply(Look& look) const
{
    look.exposure = m_exposure.value_or(look.exposure);
    look.tone = m_tone.value_or(look.tone);
}

void RenderOptions::apply(RenderParams& params) const
{
    params.light_samples = m_light_samples.value_or(params.light_samples);
    if (!m_size.empty()) {
        const std::string expected =
            "WIDTHxHEIGHT in pixels, two whole numbers from 1 on, such as 640x480";
        const std::vector<int> size = wholeNumbers("--size", m_size, 'x', 2, expected);
        params.width = size[0];
        params.height = size[1];
        if (params.width < 1 || params.height < 1)
            throw Error("--size: expected " + expected + ", found '" + m_size + "'");
    }
    if (!m_crop.empty()) {
        const std::string expected =
            "X,Y,WIDTH,HEIGHT in pixels, four whole numbers such as 100,50,64,64";
        const std::vector<int> crop = wholeNumbers("--crop", m_crop, ',', 4, expected);
        params.crop = {crop[0], crop[1], crop[2], crop[3]};
        if (params.crop.width < 1 || params.crop.height < 1)
            throw Error("--crop: expected a width and a height of at least 1 pixel, found '"
                        + m_crop + "'");
    }
    params.samples = m_samples.value_or(params.samples);
    params.pixel_filter = m_pixel_filter.value_or(params.pixel_filter);
    params.pixel_radius = m_pixel_radius.value_or(params.pixel_radius);
    params.shadows = m_shadows.value_or(params.shadows);
    params.integration = m_integration.value_or(params.integration);
    params.step = m_step.value_or(params.step);
    params.filter = m_filter.value_or(params.filter);
    params.extinction = m_extinction.value_or(params.extinction);
    params.own_shade = m_own_shade.value_or(params.own_shade);
    params.scattering = m_scattering.value_or(params.scattering);
    params.cutoff = m_cutoff.value_or(params.cutoff);
    params.lod = m_lod.value_or(params.lod);
    applyEvenDome(params, m_dome);
    if (m_background) return;
    params.background = Vec3d(0.0);
    params.dome.visible = false; // it goes on shining
}

} // namespace volcomp
