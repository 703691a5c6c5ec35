// SPDX-License-Identifier: Apache-2.0
// When a stage says in a log how far it is.
#pragma once

#include <optional>
#include <string>

#include <fmt/format.h>

namespace volcomp {

/// A time as people say it, to two units.
inline std::string timeText(double seconds)
{
    const auto whole = static_cast<long long>(seconds + 0.5);
    if (whole < 60) return fmt::format("{} s", whole);
    if (whole < 3600) return fmt::format("{} min {} s", whole / 60, whole % 60);
    return fmt::format("{} h {} min", whole / 3600, whole % 3600 / 60);
}

/// The rate and the time left of a stage that has done a fraction, above 0, in so many seconds, if
/// it goes on as it did: "2.5 %/s, 30 s left".
inline std::string paceText(double fraction, double seconds)
{
    const double rate = 100 * fraction / seconds; // per cent a second
    const std::string text =
        rate >= 0.1 ? fmt::format("{:.1f} %/s", rate) : fmt::format("{:.2g} %/min", 60 * rate);
    return text + ", " + timeText(seconds * (1 - fraction) / fraction) + " left";
}

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
        return fmt::format("{} % after {:.0f} s: {}", 10 * tens, seconds,
                           paceText(fraction, seconds));
    }

private:
    static constexpr double kSilentSeconds = 5;
    int m_said = 0; ///< tens of per cents
};

} // namespace volcomp
