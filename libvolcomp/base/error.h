// SPDX-License-Identifier: Apache-2.0
// The one exception type of the library.
//
// The message of every failure that a user can cause names the file, the place in it, what was
// expected, what was found and what to do. Bugs of our own are asserted, not thrown.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>

namespace volcomp {

class Error : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

/// Returns the error "FILE: PLACE: expected EXPECTED, found FOUND. HINT". `place` and `hint` may be
/// empty.
Error fileError(const std::filesystem::path& file, const std::string& place,
                const std::string& expected, const std::string& found,
                const std::string& hint = {});

} // namespace volcomp
