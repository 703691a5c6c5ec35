// SPDX-License-Identifier: Apache-2.0
#include "volcomp/base/error.h"

namespace volcomp {

Error fileError(const std::filesystem::path& file, const std::string& place,
                const std::string& expected, const std::string& found, const std::string& hint)
{
    std::string message = file.string() + ": ";
    if (!place.empty()) message += place + ": ";
    message += "expected " + expected + ", found " + found + ".";
    if (!hint.empty()) message += " " + hint;
    return Error(message);
}

} // namespace volcomp
