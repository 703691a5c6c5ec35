// SPDX-License-Identifier: Apache-2.0
// Which instructions the hot loops use on this processor.
#pragma once

#include <string>

namespace volcomp {

/// Returns the name of the widest set of vector instructions that this processor has, such as
/// "AVX2" or "SSE2"; "baseline" on other architectures than x86.
std::string instructionSet();

} // namespace volcomp
