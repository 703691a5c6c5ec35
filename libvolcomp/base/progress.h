// How a stage says how far it is.
#pragma once

#include <functional>

namespace volcomp {

/// Called with the fraction done, 0 to 1, not falling, from any one thread at a time. An empty
/// function is allowed: use report(). It must be quick; the tools' progress bar limits its own
/// rate.
using Progress = std::function<void(double fraction)>;

inline void report(const Progress& progress, double fraction)
{
    if (progress) progress(fraction);
}

} // namespace volcomp
