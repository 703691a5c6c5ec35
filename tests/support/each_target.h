// SPDX-License-Identifier: Apache-2.0
// Runs a check with each instruction set that the library has code for.
#pragma once

#include <cstdint>

#include <gtest/gtest.h>
#include <hwy/highway.h>

namespace volcomp {

/// Calls `check` once for each instruction set that this build has code for and this machine runs.
/// Failures name the instruction set. Call it while no other thread uses the library.
template <class Check>
void onEachTarget(const Check& check)
{
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
        SCOPED_TRACE(hwy::TargetName(target));
        hwy::SetSupportedTargetsForTest(target);
        check();
    }
    hwy::SetSupportedTargetsForTest(0);
}

} // namespace volcomp
