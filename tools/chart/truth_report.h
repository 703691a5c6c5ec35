// SPDX-License-Identifier: Apache-2.0
// Pictures against the exact geometry, in words, as a table and as JSON.
#pragma once

#include <string>
#include <vector>

#include "tools/chart/truth_study.h"

namespace volcomp {

/// Returns the volume that the title is about: the box filter, swept light, the voxel size nearest
/// to the scene's, and of its samples those that do best beside curves of the same error in blocks.
/// Null if there is no volume.
const TruthResult* referenceOf(const std::vector<TruthResult>& results);

/// Returns what a result is: "curves, 4 samples", "voxels x2, box, sweep, 4 samples".
std::string nameOf(const TruthResult& result);

/// Returns in a few words how much cheaper the reference is than curves, or they than it, at its
/// error in blocks.
std::string truthTitle(const std::string& scene, const std::vector<TruthResult>& results);

/// Returns paragraphs in Markdown: the times of volumes and curves at equal error, for the samples
/// of the reference and for the setting that does best.
std::string truthSentences(const std::vector<TruthResult>& results);

/// Returns a table in Markdown: errors, biases, each part of the time, and the time beside that of
/// curves at equal error.
std::string truthTable(const std::vector<TruthResult>& results);

/// Returns all figures: those of the scene's own light, which comes first, and in "other_lights"
/// those of the others by their names. Pictures are named as seen from `directory`.
nlohmann::json truthJson(const std::vector<TruthOfLight>& lights, const TruthSetup& setup,
                         const std::filesystem::path& directory);

} // namespace volcomp
