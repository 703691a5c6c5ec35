// SPDX-License-Identifier: Apache-2.0
#include "tools/chart/equal_error.h"

#include <cmath>

#include "tools/chart/chart.h"

namespace volcomp {
namespace {

/// Returns the measurements that count, by rising time and so by falling error.
std::vector<CurveCost> frontOf(const std::vector<CurveCost>& curves)
{
    std::vector<ChartPoint> points;
    std::vector<CurveCost> counted, front;
    for (const CurveCost& c : curves) {
        if (!(c.error > 0) || !(c.seconds > 0)) continue;
        counted.push_back(c);
        points.push_back({"", c.seconds, c.error});
    }
    for (const std::size_t i : paretoFront(points)) front.push_back(counted[i]);
    return front;
}

/// Returns the value between a and b, part 0 to 1 of the way in their logarithms.
double between(double a, double b, double part) { return a * std::pow(b / a, part); }

/// Returns what curves of more samples than `last` cost.
CurveCost beyond(const CurveCost& last, double error)
{
    const double more = std::pow(last.error / error, 2);
    return {last.samples * more, last.seconds + last.picture_seconds * (more - 1),
            last.picture_seconds * more, error};
}

} // namespace

EqualError curvesAtError(const std::vector<CurveCost>& curves, double error)
{
    const std::vector<CurveCost> front = frontOf(curves);
    if (front.empty() || !(error > 0)) return {};
    if (error >= front[0].error)
        return {EqualError::From::coarsest, front[0].seconds, front[0].samples};
    for (std::size_t i = 1; i < front.size(); ++i) {
        const CurveCost &a = front[i - 1], &b = front[i];
        if (error < b.error) continue;
        const double part = std::log(error / a.error) / std::log(b.error / a.error);
        return {EqualError::From::between, between(a.seconds, b.seconds, part),
                between(a.samples, b.samples, part)};
    }
    const CurveCost more = beyond(front.back(), error);
    return {EqualError::From::beyond, more.seconds, more.samples};
}

std::vector<CurveCost> curvesDownTo(const std::vector<CurveCost>& curves, double error, int steps)
{
    std::vector<CurveCost> line;
    for (const CurveCost& c : frontOf(curves))
        if (c.error > error) line.push_back(c);
    if (line.empty()) return line;
    const EqualError end = curvesAtError(curves, error);
    if (end.from != EqualError::From::beyond) {
        line.push_back({end.samples, end.seconds, 0, error});
        return line;
    }
    const CurveCost last = line.back();
    for (int i = 1; i <= steps; ++i)
        line.push_back(beyond(last, between(last.error, error, double(i) / steps)));
    return line;
}

} // namespace volcomp
