// SPDX-License-Identifier: Apache-2.0
#include "tools/chart/gnuplot.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include "tools/shared/process.h"
#include "volcomp/base/atomic_file.h"
#include "volcomp/base/error.h"
#include "volcomp/base/text.h"

namespace volcomp {

namespace fs = std::filesystem;

std::string gnuplotText(const std::string& text)
{
    std::string result = "'";
    for (const char c : text) result += c == '\'' ? "''" : std::string(1, c == '\n' ? ' ' : c);
    return result + "'";
}

std::string gnuplotFile(const std::string& name)
{
    std::vector<std::string> lines;
    for (std::size_t at = 0; at <= name.size();) {
        const std::size_t end = std::min(name.find('\n', at), name.size());
        lines.push_back(gnuplotText(name.substr(at, end - at)));
        at = end + 1;
    }
    return joined(lines, ".\"\\n\".");
}

std::size_t characters(const std::string& utf8)
{
    return static_cast<std::size_t>(
        std::count_if(utf8.begin(), utf8.end(), [](char c) { return (c & 0xc0) != 0x80; }));
}

void LogRange::add(double value)
{
    low = std::min(low, value);
    high = std::max(high, value);
}

LogRange LogRange::padded() const
{
    if (high <= 0) return {0.1, 10};
    const double room = std::max(1.15, std::pow(high / low, 0.06));
    return {low / room, high * room};
}

double LogRange::at(double value) const { return std::log(value / low) / std::log(high / low); }

void appendTics(std::string& script, const std::string& axis, const LogRange& r,
                const std::string& unit)
{
    const double decades = std::log10(r.high / r.low);
    script += fmt::format("set format {} {}\n", axis,
                          decades > 2.5 && unit.empty() ? "'10^{%T}'" : "'%g'");
    if (decades > 2.5 && unit.empty()) {
        script +=
            fmt::format("set {}tics autofreq\nset {}tics {}\n", axis, axis, decades > 7 ? 100 : 10);
        return;
    }
    const std::vector<double> first = decades > 2.5 ? std::vector<double>{1}
        : decades > 1.5                             ? std::vector<double>{1, 3}
                                                    : std::vector<double>{1, 2, 3, 5, 7};
    std::string list;
    for (int k = int(std::floor(std::log10(r.low))); k <= std::log10(r.high); ++k)
        for (const double m : first) {
            const double value = m * std::pow(10, k);
            const std::string text = unit.empty() ? "" : fmt::format("'{:g}{}' ", value, unit);
            list += fmt::format("{}{}{:g}", list.empty() ? "" : ", ", text, value);
        }
    script += fmt::format("set {}tics ({})\n", axis, list);
}

void drawWithGnuplot(const fs::path& directory, const std::string& name,
                     const std::function<std::string(const std::string& output)>& script)
{
    for (const char* ending : {".svg", ".png"})
        writeAtomically(directory / (name + ending), [&](const fs::path& temporary) {
            const fs::path file = directory / (name + ".gnuplot");
            writeTextAtomically(file, script(temporary.string()));
            const ProcessResult result = runProcess({"gnuplot", file.string()});
            if (result.status != 0 || fs::file_size(temporary) == 0)
                throw fileError(file, "", "a script that gnuplot draws", result.output);
        });
}

} // namespace volcomp
