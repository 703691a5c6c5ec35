// SPDX-License-Identifier: Apache-2.0
// The files that volcomp-chart --truth writes.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tools/chart/truth_study.h"
#include "tools/shared/tool.h"

namespace volcomp {

/// Returns the names of the charts' files: for `light` empty truth.svg, truth.png and
/// truth.gnuplot, for "multiple" truth_multiple.svg and so on.
std::vector<std::string> truthChartFiles(const std::string& light);

/// Draws a chart for each light, and writes truth.md and truth.json about all of them into
/// `directory`; says so, and puts the figures into the program's statistics. `lights` begin with
/// the scene's own.
void writeTruth(Tool& tool, const std::filesystem::path& directory, const std::string& scene,
                const TruthSetup& setup, const std::vector<TruthOfLight>& lights);

} // namespace volcomp
