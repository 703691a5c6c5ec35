// SPDX-License-Identifier: Apache-2.0
// How long curves traced directly take to the error that a picture of a volume has.
#pragma once

#include <vector>

namespace volcomp {

/// Curves traced with some samples per pixel. Their error is relative; that of a picture that
/// cannot be told from the exact one may be 0 or less.
struct CurveCost {
    double samples = 1;
    double seconds = 0;         ///< all that a user waits for
    double picture_seconds = 0; ///< of these, what grows with the samples
    double error = 0;
};

/// What curves need for an error.
struct EqualError {
    enum class From {
        nothing,  ///< the error is not above 0, or no curves were measured
        coarsest, ///< the fewest samples that were measured have a smaller error already
        between,  ///< interpolated between two measurements
        beyond    ///< extrapolated: more samples than were measured
    };
    From from = From::nothing;
    double seconds = 0, samples = 0;
};

/// Returns the time and the samples of curves for an error. Between measurements the logarithms of
/// time and samples are linear in that of the error. Beyond the most samples the error falls with
/// the square root of the samples, and the time of the picture grows with these. Measurements that
/// another one beats in both time and error, and those whose error is not above 0, do not count.
EqualError curvesAtError(const std::vector<CurveCost>& curves, double error);

/// The line of the curves for a chart from the cheapest measurement down to an error: the
/// measurements above it, and its continuation in `steps` steps if it lies beyond all of them.
std::vector<CurveCost> curvesDownTo(const std::vector<CurveCost>& curves, double error, int steps);

} // namespace volcomp
