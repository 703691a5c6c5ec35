// SPDX-License-Identifier: Apache-2.0
// A picture tile by tile, and all tiles in passes with pauses to show and to save what is done.
#pragma once

#include <string>
#include <vector>

#include "volcomp/base/progress.h"
#include "volcomp/render/picture_tracer.h"
#include "volcomp/render/pixel_filter.h"
#include "volcomp/render/render.h"
#include "volcomp/view/image.h"

namespace volcomp {

/// Adds samples to the tiles of a picture. A tile's pixels get their samples in order, however
/// often it is called: nothing depends on when or in which thread. Threads share it, but each tile
/// is advanced by one at a time.
class TileRenderer {
public:
    /// Instead of a number of samples: one sample in each kStride-th pixel across and down.
    static constexpr int kCoarse = -1, kStride = 4;

    /// Goes on from `state`, or from the start if that is empty; it must outlive this, as must the
    /// tracer. Throws Error if the state is one of another picture.
    TileRenderer(const PictureTracer& tracer, const std::vector<Light>& lights, RenderState& state);

    int tiles() const { return static_cast<int>(m_state.samples.size()); }
    const std::vector<std::int32_t>& samples() const { return m_state.samples; } ///< by tile
    const RenderState& state() const { return m_state; }
    /// Whether a tile has `target` samples already, or kCoarse.
    bool reached(int tile, int target) const
    {
        return m_state.samples[tile] >= target && (m_state.samples[tile] != 0 || target == 0);
    }

    TileBudget* budget() const { return m_tracer.budget(); } ///< LevelOfDetail::budget()

    /// Brings a tile to `target` samples, or to kCoarse.
    void advance(int tile, int target, Integrator::Scratch& scratch);

    /// The picture so far. Pixels without a sample show the coarse one beside them, if there is
    /// one.
    Image image() const;

private:
    static constexpr int kTile = 16; ///< pixels along an edge

    void addSample(int x, int y, int s, Integrator::Scratch& scratch);

    const PictureTracer& m_tracer;
    const PixelSampler m_sampler;
    const std::size_t m_lights;
    const std::vector<std::string> m_channels;
    const int m_columns;
    const bool m_has_background;
    RenderState& m_state;
};

/// What was traced in many rays.
struct RenderSums {
    RayCounts counts;
    std::vector<LightSum> lights; ///< by light
    double ambient = 0;           ///< radiance that comes from all around, R + G + B

    void add(const RayScratch& scratch);
};

/// Brings all tiles to all samples, with pauses for `watch` if that is set; it must then hold the
/// state of `tiles`. Returns what was traced. Throws Stopped as RenderWatch says.
RenderSums renderTiles(TileRenderer& tiles, int samples, const Progress& progress,
                       RenderWatch* watch);

} // namespace volcomp
