// SPDX-License-Identifier: Apache-2.0
// The pieces of gnuplot scripts that all charts share.
#pragma once

#include <filesystem>
#include <functional>
#include <limits>
#include <string>

namespace volcomp {

/// The text as gnuplot reads it, in quotation marks; a line break becomes a space.
std::string gnuplotText(const std::string& text);

/// The same for the name of a file, in which a line break matters.
std::string gnuplotFile(const std::string& name);

/// The number of characters of a text.
std::size_t characters(const std::string& utf8);

/// What a logarithmic axis shows.
struct LogRange {
    double low = std::numeric_limits<double>::max(), high = 0;
    void add(double value);
    /// Returns the range with room on both sides, and a range to draw if there is one value or
    /// none.
    LogRange padded() const;
    /// Where a value is, from 0 at `low` to 1 at `high`.
    double at(double value) const;
};

/// Sets the tics of an axis ("x", "y", "y2"): powers of ten, every second one over many decades; 1,
/// 2, 5 and their tens over few. With a unit, in which % is doubled, they are
/// plain numbers and the unit.
void appendTics(std::string& script, const std::string& axis, const LogRange& range,
                const std::string& unit = "");

/// Draws DIRECTORY/NAME.svg and .png, and leaves the script of the last in NAME.gnuplot. `script`
/// returns the one that draws to a file. Throws Error if gnuplot fails.
void drawWithGnuplot(const std::filesystem::path& directory, const std::string& name,
                     const std::function<std::string(const std::string& output)>& script);

} // namespace volcomp
