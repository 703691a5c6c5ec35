// SPDX-License-Identifier: Apache-2.0
// The clocks of statistics and progress.
#pragma once

namespace volcomp {

/// Seconds since an unspecified moment; only differences mean something. Never runs backwards.
double wallSeconds();

/// Seconds that processors have worked for this process so far: user and system, all threads.
double cpuSeconds();

} // namespace volcomp
