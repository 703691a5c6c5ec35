// SPDX-License-Identifier: Apache-2.0
// Measurements of one scene's volume by methods and settings, against better pictures of it.
#pragma once

#include <filesystem>
#include <vector>

#include "tools/chart/chart.h"
#include "tools/chart/chart_cache.h"
#include "tools/chart/matrix.h"
#include "tools/chart/other_light.h"
#include "tools/chart/results.h"
#include "tools/shared/tool.h"
#include "volcomp/scene/scene.h"

namespace volcomp {

/// What all measurements have in common.
struct ChartStudy {
    Tool& tool;
    const Scene& scene;              ///< with its dome loaded
    std::filesystem::path directory; ///< for what was measured
    int samples;                     ///< per pixel of the reference
    double voxel;                    ///< the scene's voxel size at the chart's width, metres
    RenderParams base; ///< exact, box, the scene's extinction, sweep, cutoff 0.001, 4 samples
    ChartCache cache;
};

/// The scene's voxel size in pictures of this size, metres. Throws Error if the camera sees no
/// surface and the scene does not say it.
double sceneVoxel(const Scene& scene, int width, int height);

/// The settings that all rows begin with, in pictures of this width.
RenderParams chartBase(const Scene& scene, int width);

/// Measures rows of radiance against a better picture in the study's light, which is `light`.
std::vector<Result> measureRadiance(ChartStudy& study, const std::vector<Row>& rows,
                                    const OtherLight& light = {});

/// Measures the transmittance through the pixels' centres against exact trilinear integration, of
/// vdb_render too, if it is installed.
std::vector<Result> measureTransmittance(ChartStudy& study);

/// Measures voxel sizes against the finest without level of detail; adds to the series of `panel`:
/// error, error with lod, seconds of rendering, of rendering with lod, of composing.
std::vector<Result> measureVoxels(ChartStudy& study, ChartPanel& panel);

/// Measures the box filter with swept light under other light than the scene's, each against its
/// own reference. `scene` is without what is left out, its dome not loaded.
std::vector<Result> measureOtherLights(Tool& tool, const Scene& scene, int width, int samples,
                                       double voxel, const std::vector<std::string>& leave_out,
                                       const std::filesystem::path& directory);

} // namespace volcomp
