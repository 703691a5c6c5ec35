// SPDX-License-Identifier: Apache-2.0
#include "tools/shared/numbers.h"

#include <charconv>
#include <cmath>
#include <cstdlib>

#include <fmt/format.h>

#include "volcomp/base/error.h"

namespace volcomp {

CLI::Validator realNumber(double low, double high)
{
    const std::string range = std::isfinite(high) ? fmt::format("from {:g} to {:g}", low, high)
                                                  : fmt::format(">= {:g}", low);
    return {[=](std::string& text) {
                char* end = nullptr;
                const double value = std::strtod(text.c_str(), &end);
                const bool number = !text.empty() && end == text.c_str() + text.size();
                if (number && std::isfinite(value) && value >= low && value <= high)
                    return std::string();
                return fmt::format("expected a finite number {}, found '{}'", range, text);
            },
            ""};
}

CLI::Validator wholeNumber(int low, int high)
{
    return {[=](std::string& text) {
                int value = 0;
                const char* end = text.data() + text.size();
                const auto read = std::from_chars(text.data(), end, value);
                if (read.ec == std::errc() && read.ptr == end && value >= low && value <= high)
                    return std::string();
                return fmt::format("expected a whole number from {} to {}, found '{}'", low, high,
                                   text);
            },
            ""};
}

int readWhole(const std::string& option, const std::string& text, const std::string& expected,
              const std::string& shown)
{
    int value = 0;
    const char* end = text.data() + text.size();
    const auto read = std::from_chars(text.data(), end, value);
    if (read.ec == std::errc() && read.ptr == end) return value;
    std::string message = option + ": expected " + expected + ", found '" + shown + "'";
    if (read.ec == std::errc::result_out_of_range && read.ptr == end)
        message += fmt::format(", where {} is beyond the largest number, {}", text,
                               std::numeric_limits<int>::max());
    throw Error(message);
}

} // namespace volcomp
