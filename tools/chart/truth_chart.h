// SPDX-License-Identifier: Apache-2.0
// The chart of pictures against the exact geometry.
#pragma once

#include <string>
#include <vector>

#include "tools/chart/truth_study.h"

namespace volcomp {

/// Returns a gnuplot script that draws to `output` (.svg or .png) what pictures cost and how far
/// they are off: pixel by pixel on the left, in blocks on the right. One line is that of curves; in
/// front of the green ground behind it a volume is cheaper than curves of the same error. Results
/// without an error above 0 are left out. `title` and the lines of `subtitle` stand above.
std::string truthScript(const std::string& title, const std::string& subtitle,
                        const std::vector<TruthResult>& results, const std::string& output);

} // namespace volcomp
