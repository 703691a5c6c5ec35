// SPDX-License-Identifier: Apache-2.0
// Checks of options that take numbers. CLI11's own let nan and inf through, and do not say why a
// whole number is too large.
#pragma once

#include <limits>
#include <string>

#include <CLI/CLI.hpp>

namespace volcomp {

/// A finite number from low to high; both ends are allowed. Without `high` there is no upper limit.
CLI::Validator realNumber(double low, double high = std::numeric_limits<double>::infinity());

/// A whole number in decimal digits from low to high; both ends are allowed.
CLI::Validator wholeNumber(int low, int high);

/// Reads a whole text as an int. Throws Error "OPTION: expected EXPECTED, found 'SHOWN'" if it is
/// anything else, or says that it is too large for any int.
int readWhole(const std::string& option, const std::string& text, const std::string& expected,
              const std::string& shown);

} // namespace volcomp
