// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/tile_renderer.h"

#include <algorithm>
#include <mutex>

#include <tbb/parallel_for.h>

#include "volcomp/base/clock.h"
#include "volcomp/base/error.h"
#include "volcomp/base/interval.h"
#include "volcomp/render/soft_lights.h"

namespace volcomp {
namespace {

std::vector<std::string> channelNames(const RenderParams& params, const std::vector<Light>& lights)
{
    std::vector<std::string> names{"R", "G", "B", "A"};
    if (!params.aovs) return names;
    names.insert(names.end(), {"Z", "N.X", "N.Y", "N.Z", "albedo.R", "albedo.G", "albedo.B"});
    for (std::size_t l = 0; l < lights.size(); ++l)
        for (const char* c : {".R", ".G", ".B"})
            names.push_back(
                (lights[l].name.empty() ? "light" + std::to_string(l + 1) : lights[l].name) + c);
    for (const char* rest : {"ambient", "background", "haze"})
        for (const char* c : {".R", ".G", ".B"}) names.push_back(rest + std::string(c));
    return names;
}

} // namespace

TileRenderer::TileRenderer(const PictureTracer& tracer, const std::vector<Light>& lights,
                           RenderState& state)
    : m_tracer(tracer), m_sampler(tracer.params()), m_lights(lights.size()),
      m_channels(channelNames(tracer.params(), lights)),
      m_columns((tracer.crop().width + kTile - 1) / kTile),
      m_has_background(tracer.params().hasBackdrop()), m_state(state)
{
    const Crop& crop = tracer.crop();
    const std::size_t values = std::size_t(crop.width) * crop.height * m_channels.size(),
                      tiles = std::size_t(m_columns) * ((crop.height + kTile - 1) / kTile);
    if (m_state.sums.empty()) {
        m_state.sums.resize(values);
        m_state.samples.resize(tiles);
    }
    if (m_state.sums.size() != values || m_state.samples.size() != tiles)
        throw Error("the state of the render is one of another picture");
}

void TileRenderer::advance(int tile, int target, Integrator::Scratch& scratch)
{
    const Crop& crop = m_tracer.crop();
    const int x0 = tile % m_columns * kTile, y0 = tile / m_columns * kTile,
              before = m_state.samples[tile];
    for (int y = y0; y < std::min(y0 + kTile, crop.height); ++y)
        for (int x = x0; x < std::min(x0 + kTile, crop.width); ++x) {
            const bool coarse = x % kStride == 0 && y % kStride == 0;
            const int from = before == kCoarse ? coarse : before,
                      to = target == kCoarse ? coarse : target;
            for (int s = from; s < to; ++s) addSample(x, y, s, scratch);
        }
    m_state.samples[tile] = target;
}

Image TileRenderer::image() const
{
    Image image;
    image.width = m_tracer.crop().width;
    image.height = m_tracer.crop().height;
    image.channels = m_channels;
    image.pixels.resize(m_state.sums.size());
    const std::size_t channels = m_channels.size();
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
            const int samples = m_state.samples[y / kTile * m_columns + x / kTile];
            if (samples == 0) continue;
            const std::size_t from = samples > 0
                ? std::size_t(y) * image.width + x
                : std::size_t(y - y % kStride) * image.width + (x - x % kStride);
            for (std::size_t c = 0; c < channels; ++c)
                image.pixel(x, y)[c] =
                    float(m_state.sums[from * channels + c] / std::max(1, samples));
        }
    return image;
}

// Sample s of pixel (x, y) of the crop.
void TileRenderer::addSample(int x, int y, int s, Integrator::Scratch& scratch)
{
    const Crop& crop = m_tracer.crop();
    const RenderParams& params = m_tracer.params();
    double* sum = &m_state.sums[(std::size_t(y) * crop.width + x) * m_channels.size()];
    const auto add = [&](std::size_t channel, const Vec3d& v) {
        for (int c = 0; c < 3; ++c) sum[channel + c] += v[c];
    };
    const Vec3d at = m_sampler.position(crop.x + x, crop.y + y, s);
    const CameraRay ray = m_tracer.ray(at[0], at[1]);
    scratch.sample = sampleNumber(params, crop.x + x, crop.y + y, s);
    const int part = lightPart(crop.x + x, crop.y + y, s, params.samples, m_tracer.lightParts());
    const double shift = levelShift(crop.x + x, crop.y + y, s, params.samples);
    const RaySample sample = m_tracer.trace(ray, scratch, nullptr, part, shift);
    const double clear = scratch.haze.transmittance(kInfinity),
                 behind = sample.transmittance * clear;
    const Vec3d background = m_has_background && behind > 0
        ? Vec3d(behind * params.backdrop(ray.direction))
        : Vec3d(0.0);
    const Vec3d haze = sample.haze + sample.transmittance * (1 - clear) * scratch.haze.colour();
    add(0, sample.radiance + background + haze);
    sum[3] += m_has_background ? 1 : 1 - behind;
    if (!params.aovs) return;
    sum[4] += sample.depth;
    add(5, sample.normal);
    add(8, sample.albedo);
    for (std::size_t l = 0; l < m_lights; ++l) add(11 + 3 * l, scratch.light_radiance[l]);
    const std::size_t rest = 11 + 3 * m_lights;
    add(rest, sample.ambient);
    add(rest + 3, background);
    add(rest + 6, haze);
}

namespace {

/// One run over all tiles and passes.
class TileRun {
public:
    TileRun(TileRenderer& tiles, int samples, const Progress& progress, RenderWatch* watch)
        : m_tiles(tiles), m_samples(samples), m_progress(progress), m_watch(watch)
    {
        for (int t = 0; t < tiles.tiles(); ++t) m_done += samplesDone(t);
    }

    RenderSums run()
    {
        for (const int target : targets())
            while (!pass(target)) { }
        return m_sums;
    }

private:
    /// The numbers of samples to which all tiles are brought one after another.
    std::vector<int> targets() const
    {
        std::vector<int> targets;
        if (m_watch && m_watch->preview)
            for (int samples = TileRenderer::kCoarse; samples < m_samples;
                 samples = samples < 1 ? 1 : 2 * samples)
                targets.push_back(samples);
        targets.push_back(m_samples);
        return targets;
    }
    /// Samples a pixel that a tile has; the coarse pass has one in 16.
    double samplesDone(int tile) const
    {
        constexpr double kCoarseShare = 1.0 / (TileRenderer::kStride * TileRenderer::kStride);
        const int samples = m_tiles.samples()[tile];
        return samples < 0 ? kCoarseShare : samples;
    }
    double part() const { return m_done / (double(m_tiles.tiles()) * m_samples); }
    bool stopAsked() const { return m_watch && m_watch->stop && m_watch->stop->load(); }
    bool pauseDue() const
    {
        return m_watch
            && (stopAsked()
                || (m_watch->update && wallSeconds() - m_updated > m_watch->every_seconds));
    }

    /// Works on the tiles that have not reached `target` until a pause is due, then tells the
    /// watch. Returns whether all tiles have reached it.
    bool pass(int target)
    {
        std::atomic<bool> left_out{false};
        TileBudget* const budget = m_tiles.budget();
        tbb::parallel_for(0, m_tiles.tiles(), [&](int tile) {
            if (m_tiles.reached(tile, target)) return;
            if (pauseDue() || (budget && budget->isFull())) left_out = true;
            else advance(tile, target);
        });
        if (budget) budget->relieve();
        const bool shows_pass = m_watch && m_watch->preview && target != m_samples;
        if (m_watch && m_watch->update && ((left_out && pauseDue()) || shows_pass)) {
            m_watch->update(m_tiles.state(), m_tiles.image());
            m_updated = wallSeconds();
        }
        if (left_out && stopAsked())
            throw Stopped("stopped after " + std::to_string(int(100 * part()))
                          + " % of the render");
        return !left_out;
    }

    void advance(int tile, int target)
    {
        Integrator::Scratch scratch;
        const double before = samplesDone(tile);
        m_tiles.advance(tile, target, scratch);
        const std::lock_guard<std::mutex> lock(m_mutex);
        m_sums.add(scratch);
        m_done += samplesDone(tile) - before;
        report(m_progress, std::min(1.0, part()));
    }

    TileRenderer& m_tiles;
    const int m_samples;
    const Progress& m_progress;
    RenderWatch* m_watch;
    std::mutex m_mutex; ///< for what follows, while tiles are worked on
    RenderSums m_sums;
    double m_done = 0, m_updated = wallSeconds();
};

} // namespace

void RenderSums::add(const RayScratch& scratch)
{
    counts.rays += scratch.counts.rays;
    counts.shadow_rays += scratch.counts.shadow_rays;
    counts.shaded_voxels += scratch.counts.shaded_voxels;
    ambient += scratch.ambient_sum;
    lights.resize(std::max(lights.size(), scratch.light_sums.size()));
    for (std::size_t l = 0; l < scratch.light_sums.size(); ++l) {
        lights[l].offered += scratch.light_sums[l].offered;
        lights[l].arrived += scratch.light_sums[l].arrived;
        lights[l].shown += scratch.light_sums[l].shown;
    }
}

RenderSums renderTiles(TileRenderer& tiles, int samples, const Progress& progress,
                       RenderWatch* watch)
{
    return TileRun(tiles, samples, progress, watch).run();
}

} // namespace volcomp
