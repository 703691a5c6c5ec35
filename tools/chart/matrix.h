// SPDX-License-Identifier: Apache-2.0
// The settings that volcomp-chart measures. A new setting is a row in matrix.cpp.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "volcomp/render/render_params.h"

namespace volcomp {

/// A setting to measure.
struct Row {
    std::string name;                          ///< beside its point in the chart
    std::string family;                        ///< the series that it belongs to
    std::function<void(RenderParams&)> change; ///< of the settings that all rows begin with
};

/// Samples per pixel of most rows. Rows with that many are also compared with a reference that
/// takes the same rays, which leaves out the error of sampling.
constexpr int kSamples = 4;

/// The family of rows that other light is measured with: box filter, swept light.
inline const std::string kOwnLightFamily = "box, sweep";

/// Returns the rows of the panel of radiance. They change the settings: exact, box, the scene's
/// extinction, sweep, cutoff 0.001, kSamples samples. Names end in the samples per pixel.
std::vector<Row> radianceRows();

/// Returns the rows of the panel of radiance under other light, whose name stands before theirs.
std::vector<Row> otherLightRows(const std::string& light);

/// Returns the settings of the reference for radiance: trilinear, shadow rays, nearly no cutoff.
RenderParams radianceReference(RenderParams params, int samples);

/// Returns the rows of the panel of transmittance through the pixels' centres with isotropic
/// extinction, which other programs can compute as well. They change: exact, box, cutoff 0.
std::vector<Row> transmittanceRows();

/// One way to render a volume that is compared with the exact geometry.
struct TruthRow {
    double factor = 1; ///< on the scene's voxel
    Filter filter = Filter::box;
    Shadows shadows = Shadows::sweep;
    int samples = 1;
};

/// Returns what is compared with the exact geometry, voxel size by voxel size, and by rising
/// samples in each method: 1, 4 and 16 samples of the box filter with swept light; at the scene's
/// voxel the same of the other filter or shadows, and 4 samples of both, the dearest. Or all of
/// these everywhere.
std::vector<TruthRow> truthRows(const std::vector<double>& factors, bool all_methods);

/// Samples per pixel of the curves that are traced directly.
inline const std::vector<int> kCurveSamples{1, 4, 16, 64};

/// The steps of vdb_render, voxels.
inline const std::vector<double> kPeerSteps{2, 1, 0.5, 0.25};

/// The voxel sizes of the panel of voxel sizes, as factors on the scene's voxel. The first is taken
/// for the truth.
inline const std::vector<double> kVoxelFactors{0.35, 0.5, 0.71, 1, 1.41, 2, 2.83, 4};

} // namespace volcomp
