// SPDX-License-Identifier: Apache-2.0
#include "tools/chart/chart.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <fmt/format.h>

#include "tools/chart/gnuplot.h"
#include "volcomp/base/text.h"
#include "volcomp/base/vec.h"

namespace volcomp {
namespace {

constexpr double kFont = 13, kCharacter = 0.57 * kFont, kLine = 1.2 * kFont; // pixels
constexpr const char* kColours[] = {"#0b5fa5", "#c8442c", "#2e8540", "#8a4bae", "#b07a00",
                                    "#4d4d4d", "#108a8a", "#d16ba5", "#7a5230", "#7d8a00"};

bool drawable(const ChartPoint& p)
{
    return p.x > 0 && p.y > 0 && std::isfinite(p.x) && std::isfinite(p.y);
}

double overlap(const LabelBox& a, const LabelBox& b)
{
    const double w = std::min(a.x + a.width, b.x + b.width) - std::max(a.x, b.x),
                 h = std::min(a.y + a.height, b.y + b.height) - std::max(a.y, b.y);
    return w > 0 && h > 0 ? w * h : 0;
}

/// Returns the box of a text at a distance from a mark in the direction `angle`, moved into the
/// frame.
LabelBox labelBeside(const std::array<double, 2>& mark, double gap, double angle,
                     const LabelBox& frame, double width, double height)
{
    const auto start = [&](double at, double direction, double size, double low, double extent) {
        const double from = direction > 0.3 ? 0 : direction < -0.3 ? -size : -0.5 * size;
        return std::clamp(at + gap * direction + from, low + 2,
                          std::max(low + 2, low + extent - size - 2));
    };
    return {start(mark[0], std::cos(angle), width, frame.x, frame.width),
            start(mark[1], std::sin(angle), height, frame.y, frame.height), width, height};
}

/// Returns the area of a box that the marks of points take, each `size` pixels wide, square pixels.
double covered(const LabelBox& box, const std::vector<std::array<double, 2>>& marks, double size)
{
    double area = 0;
    for (const auto& mark : marks)
        area += overlap(box, {mark[0] - 0.5 * size, mark[1] - 0.5 * size, size, size});
    return area;
}

/// The same of other boxes.
double covered(const LabelBox& box, const std::vector<LabelBox>& boxes)
{
    double area = 0;
    for (const LabelBox& other : boxes) area += overlap(box, other);
    return area;
}

void appendNames(std::string& script, const ChartPanel& panel, const LogRange& x, const LogRange& y,
                 int width, int height)
{
    const LabelBox frame{panel.place[0] * width, panel.place[1] * height, panel.place[2] * width,
                         panel.place[3] * height};
    std::vector<std::array<double, 2>> marks;
    std::vector<std::string> names, colours;
    for (std::size_t s = 0; s < panel.series.size(); ++s)
        for (const ChartPoint& p : panel.series[s].points) {
            if (!drawable(p) || panel.series[s].right) continue;
            marks.push_back(
                {frame.x + x.at(p.x) * frame.width, frame.y + (1 - y.at(p.y)) * frame.height});
            names.push_back(p.name);
            colours.push_back(kColours[s % std::size(kColours)]);
        }
    const std::vector<LabelBox> boxes = placeLabels(marks, names, frame, kCharacter, kLine);
    const auto screen = [&](double px, double py) {
        return fmt::format("screen {:.5f}, screen {:.5f}", px / width, 1 - py / height);
    };
    for (std::size_t i = 0; i < boxes.size(); ++i) {
        if (names[i].empty()) continue;
        const LabelBox& b = boxes[i];
        const double share = marks[i][0] < b.x ? 0
            : marks[i][0] > b.x + b.width      ? 1
                                               : 0.5; // the side towards the point is kept
        script +=
            fmt::format("set label {} at {} {} front noenhanced tc rgb '{}'\n",
                        gnuplotText(names[i]), screen(b.x + share * b.width, b.y + 0.5 * b.height),
                        share == 0       ? "left"
                            : share == 1 ? "right"
                                         : "center",
                        colours[i]);
        const double to_x = std::clamp(marks[i][0], b.x, b.x + b.width),
                     to_y = std::clamp(marks[i][1], b.y, b.y + b.height);
        if (std::hypot(to_x - marks[i][0], to_y - marks[i][1]) > 10)
            script += fmt::format("set arrow from {} to {} nohead front lw 1 lc rgb '#999999'\n",
                                  screen(marks[i][0], marks[i][1]), screen(to_x, to_y));
    }
}

/// The values of a panel's axes, and the points that its Pareto front is taken of.
struct PanelData {
    LogRange x, y, right;
    std::vector<ChartPoint> left_points;
};

PanelData dataOf(const ChartPanel& panel)
{
    PanelData data;
    for (const ChartSeries& s : panel.series)
        for (const ChartPoint& p : s.points) {
            if (!drawable(p)) continue;
            data.x.add(p.x);
            (s.right ? data.right : data.y).add(p.y);
            if (!s.right && !s.apart) data.left_points.push_back(p);
        }
    data.x = data.x.padded();
    data.y = data.y.padded();
    data.right = data.right.padded();
    return data;
}

void appendAxes(std::string& script, const ChartPanel& panel, const PanelData& data)
{
    const auto& [left, top, w, h] = panel.place;
    script += fmt::format("unset label\nunset arrow\n"
                          "set lmargin at screen {:.5f}\nset rmargin at screen {:.5f}\n"
                          "set tmargin at screen {:.5f}\nset bmargin at screen {:.5f}\n",
                          left, left + w, 1 - top, 1 - top - h);
    script += fmt::format(
        "set title {} noenhanced\nset xlabel {} noenhanced\nset ylabel {} noenhanced\n",
        gnuplotText(panel.title), gnuplotText(panel.x_label), gnuplotText(panel.y_label));
    script += fmt::format("set xrange [{:g}:{:g}]\nset yrange [{:g}:{:g}]\n", data.x.low,
                          data.x.high, data.y.low, data.y.high);
    appendTics(script, "x", data.x);
    appendTics(script, "y", data.y);
    script += fmt::format("set key {}\n", panel.key);
    if (panel.right_label.empty()) {
        script += "unset y2tics\nunset y2label\nset ytics mirror\n";
        return;
    }
    script +=
        fmt::format("set ytics nomirror\nset y2label {} noenhanced\nset y2range [{:g}:{:g}]\n",
                    gnuplotText(panel.right_label), data.right.low, data.right.high);
    appendTics(script, "y2", data.right);
}

/// Adds the points as a block of data with a name, without those that cannot be drawn.
void appendData(std::string& script, const std::string& name, const std::vector<ChartPoint>& points)
{
    script += fmt::format("${} << END\n", name);
    for (const ChartPoint& p : points)
        if (drawable(p)) script += fmt::format("{:.9g} {:.9g}\n", p.x, p.y);
    script += "END\n";
}

/// Returns the term of the plot command that draws a series from its block of data.
std::string plotOf(const ChartSeries& series, const std::string& data, const char* colour)
{
    const bool markers = !series.line || series.points.size() < 20;
    const char* style = !series.line ? "points" : markers ? "linespoints" : "lines";
    return fmt::format("${} using 1:2 {} with {} {} lw 2 lc rgb '{}' {}", data,
                       series.right ? "axes x1y2" : "", style,
                       !markers           ? ""
                           : series.apart ? "pt 6 ps 1"
                                          : "pt 7 ps 0.9",
                       colour,
                       series.name.empty() ? "notitle"
                                           : "title " + gnuplotText(series.name) + " noenhanced");
}

void appendPanel(std::string& script, const ChartPanel& panel, std::size_t index, int width,
                 int height)
{
    const PanelData data = dataOf(panel);
    appendAxes(script, panel, data);
    std::vector<std::string> plots;
    if (panel.front && !data.left_points.empty()) {
        std::vector<ChartPoint> front;
        for (const std::size_t i : paretoFront(data.left_points))
            front.push_back(data.left_points[i]);
        const std::string name = fmt::format("front{}", index);
        appendData(script, name, front);
        plots.push_back(fmt::format(
            "${} using 1:2 with lines lw 5 lc rgb '#e4e4e4' title 'Pareto front'", name));
    }
    for (std::size_t s = 0; s < panel.series.size(); ++s) {
        const ChartSeries& series = panel.series[s];
        if (std::none_of(series.points.begin(), series.points.end(), drawable)) continue;
        const std::string name = fmt::format("points{}_{}", index, s);
        appendData(script, name, series.points);
        plots.push_back(plotOf(series, name, kColours[s % std::size(kColours)]));
    }
    appendNames(script, panel, data.x, data.y, width, height);
    script += plots.empty() ? "plot NaN notitle\n" : "plot " + joined(plots, ", \\\n  ") + "\n";
}

} // namespace

std::vector<std::size_t> paretoFront(const std::vector<ChartPoint>& points)
{
    std::vector<std::size_t> order(points.size()), front;
    std::iota(order.begin(), order.end(), std::size_t(0));
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        return points[a].x < points[b].x
            || (points[a].x == points[b].x && points[a].y < points[b].y);
    });
    for (const std::size_t i : order)
        if (front.empty() || points[i].y < points[front.back()].y) front.push_back(i);
    return front;
}

int cheapestWithin(const std::vector<ChartPoint>& points, double limit)
{
    int best = -1;
    for (std::size_t i = 0; i < points.size(); ++i)
        if (points[i].y <= limit && (best < 0 || points[i].x < points[best].x))
            best = static_cast<int>(i);
    return best;
}

std::vector<LabelBox> placeLabels(const std::vector<std::array<double, 2>>& marks,
                                  const std::vector<std::string>& names, const LabelBox& frame,
                                  double character_width, double line_height,
                                  const std::vector<std::array<double, 2>>& lines)
{
    std::vector<LabelBox> boxes; // of the names so far
    boxes.reserve(marks.size());
    for (std::size_t i = 0; i < marks.size(); ++i) {
        LabelBox best{marks[i][0], marks[i][1], 0, 0};
        double least = std::numeric_limits<double>::max();
        if (!names[i].empty())
            for (const double gap : {7.0, 14.0, 24.0, 36.0, 52.0, 70.0})
                for (int turn = 0; turn < 16; ++turn) {
                    const LabelBox box =
                        labelBeside(marks[i], gap, turn * 2 * kPi / 16, frame,
                                    character_width * double(characters(names[i])), line_height);
                    const double cost = 0.6 * gap
                        + 3 * (covered(box, boxes) + covered(box, marks, 10))
                        + 1.5 * covered(box, lines, 4);
                    if (cost >= least) continue;
                    least = cost;
                    best = box;
                }
        boxes.push_back(best);
    }
    return boxes;
}

std::string gnuplotScript(const std::vector<ChartPanel>& panels, int width, int height,
                          const std::string& output)
{
    const bool svg = output.size() > 4 && output.compare(output.size() - 4, 4, ".svg") == 0;
    std::string script = svg
        ? fmt::format("set terminal svg size {},{} font 'DejaVu Sans,{}' background 'white'\n",
                      width, height, kFont)
        : fmt::format("set terminal pngcairo size {},{} font 'DejaVu Sans,{}' background 'white'\n",
                      width, height, 0.77 * kFont);
    script += fmt::format("set output {}\n", gnuplotFile(output));
    script += "set encoding utf8\nset multiplot\nset logscale xyy2\nset mxtics 10\nset mytics 10\n"
              "set grid xtics ytics lc rgb '#eeeeee' lw 1\nset border lc rgb '#555555'\n"
              "set tics textcolor rgb '#333333'\nset key reverse Left samplen 1.5\n";
    for (std::size_t i = 0; i < panels.size(); ++i)
        appendPanel(script, panels[i], i, width, height);
    return script + "unset multiplot\nset output\n";
}

} // namespace volcomp
