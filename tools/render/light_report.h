// SPDX-License-Identifier: Apache-2.0
// Why a picture is dark: what each light brings, in words and for the statistics.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "volcomp/render/render.h"
#include "volcomp/view/light.h"

namespace volcomp {

/// One line with each light's share of what is seen and how much of it arrives, then a line for
/// each light that shines on nothing or of which less than 1 % arrives. Nothing if no ray was
/// traced or there is no light. `lights` are those of the render, in its order.
std::vector<std::string> lightReport(const std::vector<Light>& lights, const RenderStats& stats);

/// The same for the statistics: name, seen and arrives (null if it shines on nothing) of each
/// light, and seen of "ambient", rounded to four digits.
nlohmann::json lightStats(const std::vector<Light>& lights, const RenderStats& stats);

} // namespace volcomp
