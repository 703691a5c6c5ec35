// SPDX-License-Identifier: Apache-2.0
// What volcomp-chart has measured, as errors, tables and rows of a file.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tools/chart/matrix.h"
#include "volcomp/view/image.h"

namespace volcomp {

/// One measured setting.
struct Result {
    Row row;
    nlohmann::json settings;
    double error, cpu_seconds;
    double method_error = -1; ///< without the error of sampling; below 0 if it is not known
    bool other_light = false; ///< the reference has this row's own light (OtherLight)
};

/// The least error that is told apart from none: pictures are floats.
constexpr double kLeastError = 1e-6;

inline const std::vector<std::string> kRgb{"R", "G", "B"};

/// Returns the root mean square difference over all pixels and the given channels, relative to the
/// mean of the reference. Throws Error if a channel is missing or the reference is black.
double relativeError(const Image& image, const Image& reference,
                     const std::vector<std::string>& channels);

/// Returns tables in Markdown that say which setting is the quickest within a limit of error, and
/// one of what was measured under other light, which is no choice of settings.
std::string choiceTables(const std::vector<Result>& radiance,
                         const std::vector<Result>& transmittance);

/// Returns a line of CSV for each result: panel, name, family, CPU seconds, error, error without
/// sampling, settings.
std::string csvRows(const std::string& panel, const std::vector<Result>& results);

} // namespace volcomp
