// SPDX-License-Identifier: Apache-2.0
#include "tools/chart/truth_chart.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "tools/chart/chart.h"
#include "tools/chart/gnuplot.h"

namespace volcomp {
namespace {

constexpr int kWidth = 900, kHeight = 520; // of the page; .png has twice as many pixels
constexpr double kFont = 12, kCharacter = 0.6 * kFont, kLine = 1.25 * kFont;
constexpr const char* kCurveColour = "#222222";
constexpr const char* kSceneVoxel = "#0b5fa5";
constexpr const char* kOtherMethod = "#6aa7dc";
constexpr const char* kOtherVoxels[] = {"#8a4bae", "#c8442c", "#b07a00", "#108a8a", "#d16ba5"};
constexpr const char *kVolumesGround = "#e6f3e6", *kCurvesGround = "#fbf1e6";

using Place = std::array<double, 2>;

/// Points that a line joins, by rising samples.
struct Line {
    std::string name, colour;
    double width = 1.5;
    bool dashed = false;
    std::vector<ChartPoint> points; ///< seconds, error in per cent; named if they are to be
    std::vector<int> samples;
};

/// One pair of axes: left, top, width and height on the page in pixels.
struct Axes {
    LabelBox frame;
    LogRange x, y;

    Place at(double seconds, double error) const
    {
        return {frame.x + x.at(seconds) * frame.width, frame.y + (1 - y.at(error)) * frame.height};
    }
};

double errorOf(const TruthResult& r, bool blocks)
{
    return 100 * (blocks ? r.error.block_rmse : r.error.rmse);
}

std::vector<CurveCost> curvesOf(const std::vector<TruthResult>& results, bool blocks)
{
    std::vector<CurveCost> curves;
    for (const TruthResult& r : results)
        if (r.curves)
            curves.push_back({double(r.row.samples), r.costs.sum().cpu, r.costs.picture.cpu,
                              errorOf(r, blocks)});
    return curves;
}

/// The name, colour and width of the line that a result is on.
Line styleOf(const TruthResult& r, std::vector<double>& other_factors)
{
    if (r.curves) return {"", kCurveColour, 3, false, {}, {}};
    const bool first = r.row.filter == Filter::box && r.row.shadows == Shadows::sweep;
    if (r.row.factor == 1) {
        if (first) return {"voxels of the scene", kSceneVoxel, 3, false, {}, {}};
        const bool both = r.row.filter == Filter::trilinear && r.row.shadows == Shadows::exact;
        return {both ? "trilinear, shadow rays" : "", kOtherMethod, 1, true, {}, {}};
    }
    auto at = std::find(other_factors.begin(), other_factors.end(), r.row.factor);
    if (at == other_factors.end()) at = other_factors.insert(at, r.row.factor);
    const char* colour =
        kOtherVoxels[std::size_t(at - other_factors.begin()) % std::size(kOtherVoxels)];
    return {first ? fmt::format("voxels ×{:g}", r.row.factor) : "",
            colour,
            first ? 1.5 : 0.7,
            !first,
            {},
            {}};
}

/// The lines of all results, that of the curves first.
std::vector<Line> linesOf(const std::vector<TruthResult>& results, bool blocks)
{
    std::vector<Line> lines;
    std::vector<double> other_factors;
    const TruthResult* last = nullptr;
    for (const TruthResult& r : results) {
        const bool same = last && last->curves == r.curves && last->row.factor == r.row.factor
            && last->row.filter == r.row.filter && last->row.shadows == r.row.shadows;
        if (!same) lines.push_back(styleOf(r, other_factors));
        last = &r;
        const double error = errorOf(r, blocks);
        if (!(error > 0)) continue;
        lines.back().points.push_back({"", r.costs.sum().cpu, error});
        lines.back().samples.push_back(r.row.samples);
    }
    if (results.empty() || !results[0].curves) return lines;
    Line& curves = lines[0]; // the others get theirs from nameEnds()
    for (std::size_t i = 0; i < curves.points.size(); ++i)
        curves.points[i].name = i + 1 < curves.points.size()
            ? std::to_string(curves.samples[i])
            : fmt::format("curves, {} samples", curves.samples[i]);
    return lines;
}

/// The curves' line, down to the bottom of the axes or to their right end.
std::vector<CurveCost> wholeLine(const std::vector<CurveCost>& curves, const Axes& axes)
{
    std::vector<CurveCost> line = curvesDownTo(curves, axes.y.low, 40);
    for (CurveCost& c : line) c.error = std::max(c.error, axes.y.low * 1.0001);
    while (line.size() > 1 && line[line.size() - 2].seconds > axes.x.high) line.pop_back();
    return line;
}

/// The ground: where a point is cheaper than curves of its error, and where it is dearer.
void appendGrounds(std::string& script, const std::vector<CurveCost>& line, const Axes& axes)
{
    script += fmt::format("set object 1 rectangle from graph 0,0 to graph 1,1 behind fs solid "
                          "noborder fc rgb '{}'\n",
                          line.empty() ? "#ffffff" : kCurvesGround);
    if (line.empty()) return;
    const auto point = [&](double seconds, double error) {
        return fmt::format("{:.9g},{:.9g}", std::clamp(seconds, axes.x.low, axes.x.high),
                           std::clamp(error, axes.y.low, axes.y.high));
    };
    std::string text = "set object 2 polygon from " + point(axes.x.low, axes.y.low) + " to "
        + point(axes.x.low, axes.y.high) + " to " + point(line[0].seconds, axes.y.high);
    for (const CurveCost& c : line) text += " to " + point(c.seconds, c.error);
    text +=
        " to " + point(line.back().seconds, axes.y.low) + " to " + point(axes.x.low, axes.y.low);
    script += text + fmt::format(" behind fs solid noborder fc rgb '{}'\n", kVolumesGround);
}

std::string screen(double x, double y)
{
    return fmt::format("screen {:.5f}, screen {:.5f}", x / kWidth, 1 - y / kHeight);
}

/// The text in bold, for gnuplot's enhanced mode: .svg knows no font of another name for it.
std::string inBold(const std::string& text)
{
    std::string escaped;
    for (const char c : text)
        escaped += std::string("\\{}^_@&~").find(c) == std::string::npos ? std::string(1, c)
                                                                         : std::string("\\") + c;
    return "{/:Bold " + escaped + "}";
}

void appendText(std::string& script, const std::string& text, double x, double y,
                const char* alignment, const std::string& colour, double font, bool bold = false)
{
    script +=
        fmt::format("set label {} at {} {} front {}enhanced tc rgb '{}' font 'DejaVu Sans,{:g}'\n",
                    gnuplotText(bold ? inBold(text) : text), screen(x, y), alignment,
                    bold ? "" : "no", colour, font);
}

double distance(const Place& a, const Place& b) { return std::hypot(b[0] - a[0], b[1] - a[1]); }

/// Adds the places on the line between two points, which names keep away from.
void addBetween(std::vector<Place>& places, const Place& a, const Place& b)
{
    const int steps = int(distance(a, b) / 9);
    for (int i = 1; i < steps; ++i) {
        const double t = double(i) / steps;
        places.push_back({a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])});
    }
}

/// Gives each line's name to that of its ends which has more room beside it.
void nameEnds(std::vector<Line>& lines, const Axes& axes)
{
    std::vector<Place> taken;
    for (const Line& line : lines)
        for (std::size_t i = 0; i < line.points.size(); ++i) {
            const Place place = axes.at(line.points[i].x, line.points[i].y);
            taken.push_back(place);
            if (i > 0)
                addBetween(taken, axes.at(line.points[i - 1].x, line.points[i - 1].y), place);
        }
    for (Line& line : lines) {
        if (line.name.empty() || line.points.empty()) continue;
        const double reach = 20 + kCharacter * double(characters(line.name));
        const auto crowd = [&](const ChartPoint& end, double side) {
            const Place at = axes.at(end.x, end.y);
            const double outside = side < 0 ? axes.frame.x - (at[0] - reach)
                                            : at[0] + reach - axes.frame.x - axes.frame.width;
            return std::max(0.0, outside)
                + 8 * double(std::count_if(taken.begin(), taken.end(), [&](const Place& other) {
                      const double away = side * (other[0] - at[0]);
                      return away > 1 && away < reach && std::abs(other[1] - at[1]) < 9;
                  }));
        };
        ChartPoint &first = line.points.front(), &last = line.points.back();
        (crowd(first, -1) < crowd(last, 1) ? first : last).name = line.name;
    }
}

/// Joins a point with its name by a thin line if they are far from each other.
void appendLeader(std::string& script, const Place& mark, const LabelBox& name,
                  const std::string& colour)
{
    const Place end{std::clamp(mark[0], name.x, name.x + name.width),
                    std::clamp(mark[1], name.y + 2, name.y + name.height - 2)};
    if (distance(mark, end) < 14) return;
    script += fmt::format("set arrow from {} to {} nohead front lw 0.6 lc rgb '{}'\n",
                          screen(mark[0], mark[1]), screen(end[0], end[1]), colour);
}

/// Writes the names beside the points, away from points, lines and the words in the corners.
void appendNames(std::string& script, const std::vector<Line>& lines,
                 const std::vector<CurveCost>& whole, const Axes& axes)
{
    const LabelBox& f = axes.frame;
    std::vector<Place> marks;
    std::vector<std::string> names, colours;
    std::vector<bool> bold;
    for (const Line& line : lines)
        for (const ChartPoint& p : line.points) {
            if (p.name.empty()) continue;
            marks.push_back(axes.at(p.x, p.y));
            names.push_back(p.name);
            colours.push_back(line.colour);
            bold.push_back(line.width >= 3 && p.name.size() > 3);
        }
    const std::size_t named = marks.size();
    std::vector<Place> between;
    for (const Line& line : lines)
        for (std::size_t i = 0; i < line.points.size(); ++i) {
            const Place here = axes.at(line.points[i].x, line.points[i].y);
            if (line.points[i].name.empty()) marks.push_back(here);
            if (i > 0)
                addBetween(between, axes.at(line.points[i - 1].x, line.points[i - 1].y), here);
        }
    Place last{-1e9, 0};
    for (const CurveCost& c : whole) { // beyond the measurements its points are dense
        const Place here = axes.at(c.seconds, c.error);
        if (distance(last, here) < 7) continue;
        between.push_back(here);
        last = here;
    }
    for (double x = 4; x < 132; x += 8)
        for (const double y : {6.0, 14.0, 22.0}) {
            marks.push_back({f.x + x, f.y + f.height - y});
            marks.push_back({f.x + f.width - x, f.y + y});
        }
    names.resize(marks.size());
    const std::vector<LabelBox> boxes = placeLabels(marks, names, f, kCharacter, kLine, between);
    for (std::size_t i = 0; i < named; ++i) {
        const LabelBox& b = boxes[i];
        const bool right_of = marks[i][0]<b.x, left_of = marks[i][0]> b.x + b.width;
        const double share = right_of ? 0 : left_of ? 1 : 0.5; // the side towards the point is kept
        appendLeader(script, marks[i], b, colours[i]);
        appendText(script, names[i], b.x + share * b.width, b.y + 0.5 * b.height,
                   right_of      ? "left"
                       : left_of ? "right"
                                 : "center",
                   colours[i], kFont - 1, bold[i]);
    }
}

/// Adds a block of data with a name: time, error, size of the mark.
void appendLine(std::string& script, const std::string& name, const Line& line)
{
    script += fmt::format("${} << END\n", name);
    for (std::size_t i = 0; i < line.points.size(); ++i)
        script += fmt::format("{:.9g} {:.9g} {:.3g}\n", line.points[i].x, line.points[i].y,
                              0.45 + 0.1 * std::log2(line.samples[i]));
    script += "END\n";
}

void appendAxes(std::string& script, const Axes& axes, const std::string& title)
{
    const LabelBox& f = axes.frame;
    script += "unset label\nunset arrow\nunset object\nunset key\n";
    script += fmt::format(
        "set lmargin at screen {:.5f}\nset rmargin at screen {:.5f}\nset tmargin at screen "
        "{:.5f}\nset bmargin at screen {:.5f}\n",
        f.x / kWidth, (f.x + f.width) / kWidth, 1 - f.y / kHeight, 1 - (f.y + f.height) / kHeight);
    script += fmt::format("set xrange [{:g}:{:g}]\nset yrange [{:g}:{:g}]\n", axes.x.low,
                          axes.x.high, axes.y.low, axes.y.high);
    appendTics(script, "x", axes.x, " s");
    appendTics(script, "y", axes.y, " %%");
    appendText(script, title, f.x, f.y - 14, "left", "#222222", kFont + 0.5, true);
    appendText(script, "CPU time until the picture is there", f.x + 0.5 * f.width,
               f.y + f.height + 36, "center", "#333333", kFont - 1);
}

void appendPanel(std::string& script, const std::vector<TruthResult>& results, bool blocks,
                 const LabelBox& frame, const LogRange& x)
{
    std::vector<Line> lines = linesOf(results, blocks);
    Axes axes{frame, x, {}};
    for (const Line& line : lines)
        for (const ChartPoint& p : line.points) axes.y.add(p.y);
    axes.y = axes.y.padded();
    axes.y.low /= 1.2; // room for names below the lowest points, and for the words in the corner
    axes.y.high *= 1.2;
    nameEnds(lines, axes);
    appendAxes(script, axes, blocks ? "Error in blocks of 4x4 pixels" : "Error of single pixels");
    const std::vector<CurveCost> whole = wholeLine(curvesOf(results, blocks), axes);
    appendGrounds(script, whole, axes);
    appendText(script, "volumes are cheaper", frame.x + 8, frame.y + frame.height - 13, "left",
               "#2f7a3a", kFont - 1, true);
    appendText(script, "curves are cheaper", frame.x + frame.width - 8, frame.y + 13, "right",
               "#a4661a", kFont - 1, true);
    appendNames(script, lines, whole, axes);

    const std::string id = blocks ? "b" : "p";
    script += fmt::format("$whole{} << END\n", id);
    for (const CurveCost& c : whole) script += fmt::format("{:.9g} {:.9g}\n", c.seconds, c.error);
    script += "END\n";
    std::string plots = "plot NaN notitle";
    if (!whole.empty())
        plots += fmt::format(", \\\n  $whole{} using 1:2 with lines lw 1.5 dt 3 lc rgb '{}'", id,
                             kCurveColour);
    for (std::size_t i = lines.size(); i-- > 0;) { // the curves last, in front
        const Line& line = lines[i];
        if (line.points.empty()) continue;
        appendLine(script, fmt::format("line{}{}", id, i), line);
        plots += fmt::format(", \\\n  $line{}{} using 1:2 with lines lw {:g} {} lc rgb '{}'", id, i,
                             line.width, line.dashed ? "dt 2" : "", line.colour);
        plots += fmt::format(", \\\n  $line{}{} using 1:2:3 with points pt 7 ps variable lc rgb "
                             "'{}'",
                             id, i, line.colour);
    }
    script += plots + "\n";
}

} // namespace

std::string truthScript(const std::string& title, const std::string& subtitle,
                        const std::vector<TruthResult>& results, const std::string& output)
{
    const bool svg = output.size() > 4 && output.compare(output.size() - 4, 4, ".svg") == 0;
    std::string script = svg
        ? fmt::format("set terminal svg size {},{} font 'DejaVu Sans,{:g}' background 'white'\n",
                      kWidth, kHeight, kFont)
        : fmt::format("set terminal pngcairo size {},{} font 'DejaVu Sans,{:g}' fontscale 1.54 "
                      "linewidth 2 pointscale 2 background 'white'\n", // points of 1/72 inch
                      2 * kWidth, 2 * kHeight, kFont);
    script += fmt::format("set output {}\n", gnuplotFile(output));
    script += "set encoding utf8\nset multiplot\nset logscale xy\nset mxtics 10\nset mytics 10\n"
              "set grid xtics ytics lc rgb '#c8c8c8' lw 0.6\nset border lc rgb '#555555' lw 0.7\n"
              "set tics textcolor rgb '#333333' scale 0.6\n";
    LogRange x;
    for (const TruthResult& r : results) x.add(r.costs.sum().cpu);
    x = x.padded();
    appendPanel(script, results, false, {62, 106, 372, 350}, x);
    // Labels of a panel are drawn with it, so that the page's own come after the first.
    std::string second;
    appendPanel(second, results, true, {512, 106, 372, 350}, x);
    const std::size_t plot = second.find("plot NaN");
    std::string words;
    appendText(words, title, 14, 22, "left", "#111111", kFont + 4, true);
    for (std::size_t at = 0, y = 45; at <= subtitle.size(); y += 17) {
        const std::size_t end = std::min(subtitle.find('\n', at), subtitle.size());
        appendText(words, subtitle.substr(at, end - at), 14, double(y), "left", "#444444",
                   kFont - 1);
        at = end + 1;
    }
    script += second.insert(plot, words);
    return script + "unset multiplot\nset output\n";
}

} // namespace volcomp
