// SPDX-License-Identifier: Apache-2.0
// When a stage says in a log how far it is.
#pragma once

#include <optional>
#include <string>

#include <fmt/format.h>

namespace volcomp {

/// The lines of one stage: none in its first five seconds, and then one for each ten per cent that
/// is reached, or for the last of several that are reached at once. Nobody reads the others. 100 %
/// has no line, because the stage then says how long it took.
class ProgressLines {
public:
    /// Returns what to say when the fraction is done after so many seconds of the stage.
    std::optional<std::string> next(double fraction, double seconds)
    {
        const int tens = static_cast<int>(10 * fraction + 1e-9);
        if (seconds < kSilentSeconds || tens <= m_said || tens >= 10) return {};
        m_said = tens;
        return fmt::format("{} % after {:.0f} s", 10 * tens, seconds);
    }

private:
    static constexpr double kSilentSeconds = 5;
    int m_said = 0; ///< tens of per cents
};

} // namespace volcomp
