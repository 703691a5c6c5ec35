// SPDX-License-Identifier: Apache-2.0
// Growth rules that several tests begin with.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "volcomp/grow/growth_rule.h"

namespace volcomp {

/// Returns a rule named `name` of one material with these levels; all else has its default.
inline GrowthRule growthRule(std::vector<GrowthLevel> levels, const std::string& name = "test",
                             const std::string& material = "m")
{
    GrowthRule rule;
    rule.name = name;
    rule.material = material;
    rule.levels = std::move(levels);
    return rule;
}

} // namespace volcomp
