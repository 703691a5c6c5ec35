// SPDX-License-Identifier: Apache-2.0
// What --version prints.
#pragma once

#include <string>

namespace volcomp {

/// Returns several lines: the program with its version; the libraries that it was built with and
/// their versions; the vector instructions in use on this machine; the licences.
std::string versionText(const std::string& program);

} // namespace volcomp
