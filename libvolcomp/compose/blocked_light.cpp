// SPDX-License-Identifier: Apache-2.0
#include "volcomp/compose/blocked_light.h"

#include <algorithm>
#include <cmath>

#include "volcomp/compose/box_source.h"

namespace volcomp {
namespace {

/// Beyond this edge in voxels of the composite the factor goes to 1 as the border of a voxel does
/// against its area.
constexpr double kLargeStep = 2;

/// Optical depths of columns of voxels along one axis.
class Columns {
public:
    /// From `low` on, `size` columns along the two other axes.
    Columns(const double (&low)[2], const double (&high)[2])
    {
        for (int i = 0; i < 2; ++i) {
            m_low[i] = std::floor(low[i]);
            m_size[i] = static_cast<std::size_t>(std::ceil(high[i]) - m_low[i]) + 1;
        }
        m_depths.resize(m_size[0] * m_size[1]);
    }
    /// Adds a square of edge `width` with its lowest corner at `at`: to each column `depth` times
    /// the part of it that it covers.
    void add(const double (&at)[2], double width, double depth)
    {
        double from[2];
        for (int i = 0; i < 2; ++i) from[i] = at[i] - m_low[i];
        const auto share = [&](int i, std::size_t column) {
            return std::min(from[i] + width, double(column) + 1)
                - std::max(from[i], double(column));
        };
        for (auto x = static_cast<std::size_t>(from[0]); double(x) < from[0] + width; ++x) {
            const double in_x = depth * share(0, x);
            for (auto y = static_cast<std::size_t>(from[1]); double(y) < from[1] + width; ++y)
                m_depths[x * m_size[1] + y] += static_cast<float>(in_x * share(1, y));
        }
    }
    /// Appends the depths that are not 0.
    void appendTo(std::vector<float>& depths) const
    {
        std::copy_if(m_depths.begin(), m_depths.end(), std::back_inserter(depths),
                     [](float d) { return d > 0; });
    }

private:
    double m_low[2] = {0, 0};
    std::size_t m_size[2] = {0, 0};
    std::vector<float> m_depths;
};

/// The densities of a part's voxels for light along an axis.
std::vector<double> densitiesAlong(const SourcePart& part, int axis)
{
    std::vector<double> densities(part.voxels.size());
    for (std::size_t k = 0; k < densities.size(); ++k)
        densities[k] = part.densityAlong(std::uint32_t(k), axis);
    return densities;
}

/// The depths of the columns along an axis, if a part's voxels have edges of `step`, at least 1, or
/// are spread to 1. `shift` moves them against the columns.
std::vector<float> columnsOf(const SourcePart& part, int axis, const std::vector<double>& densities,
                             double step, const double (&shift)[2])
{
    const double width = std::max(1.0, step), thinner = step / width,
                 depth = part.voxel * thinner * thinner; // of density 1
    const std::vector<float>* place[3] = {&part.x, &part.y, &part.z};
    const int across[2] = {(axis + 1) % 3, (axis + 2) % 3};
    const double offset[2] = {shift[0] - 0.5 * width, shift[1] - 0.5 * width};
    double low[2], high[2];
    for (int i = 0; i < 2; ++i) {
        const double centre = part.bounds.centre[across[i]] * step,
                     half = part.bounds.half[across[i]] * step + width;
        low[i] = centre - half + offset[i];
        high[i] = centre + half + offset[i] + width;
    }
    Columns columns(low, high);
    for (std::size_t k = 0; k < densities.size(); ++k) {
        const double at[2] = {double((*place[across[0]])[k]) * step + offset[0],
                              double((*place[across[1]])[k]) * step + offset[1]};
        columns.add(at, width, densities[k] * depth);
    }
    std::vector<float> depths;
    columns.appendTo(depths);
    return depths;
}

/// The depths of all columns along all three axes, for each of the steps.
std::vector<std::vector<float>> columnsOf(const SourcePart& part, const std::vector<double>& steps)
{
    constexpr double kShifts[2][2] = {{0.21, 0.67}, {0.83, 0.4}}; // two places anywhere
    std::vector<std::vector<float>> along(steps.size() * 6);      // by step, shift, axis
    for (int axis = 0; axis < 3; ++axis) {
        const std::vector<double> densities = densitiesAlong(part, axis);
        for (std::size_t i = 0; i < 2 * steps.size(); ++i)
            along[3 * i + std::size_t(axis)] =
                columnsOf(part, axis, densities, steps[i / 2], kShifts[i % 2]);
    }
    std::vector<std::vector<float>> depths(steps.size());
    for (std::size_t i = 0; i < along.size(); ++i)
        depths[i / 6].insert(depths[i / 6].end(), along[i].begin(), along[i].end());
    return depths;
}

/// The area that columns block if their depths are multiplied by `factor`, in columns; and its
/// slope.
std::pair<double, double> blockedArea(const std::vector<float>& depths, double factor)
{
    double area = 0, slope = 0;
    for (const float d : depths) {
        const double passes = std::exp(-factor * double(d));
        area += 1 - passes;
        slope += double(d) * passes;
    }
    return {area, slope};
}

/// The factor for which the columns block `wanted`. The area is concave in the factor, so that
/// Newton's method from below comes up to it without passing it.
double factorFor(const std::vector<float>& depths, double wanted)
{
    double factor = 0;
    for (int i = 0; i < 20; ++i) {
        const auto [area, slope] = blockedArea(depths, factor);
        if (!(slope > 0)) break;
        const double step = (wanted - area) / slope;
        factor += step;
        if (std::abs(step) < 1e-5 * factor) break;
    }
    return std::clamp(factor, 0.05, 2.0);
}

double columnCount(const SourcePart& part, double step)
{
    const Vec3f& h = part.bounds.half;
    const double x = 2 * step * h[0] + 4, y = 2 * step * h[1] + 4, z = 2 * step * h[2] + 4;
    return std::max({x * y, y * z, z * x});
}

} // namespace

double blockedBy(const SourcePart& own)
{
    if (own.voxels.empty() || columnCount(own, 1) > BlockedFactors::kMostColumns) return 0;
    const double aligned[2] = {0.5, 0.5}; // with the columns of the part's own voxels
    std::vector<float> depths;
    for (int axis = 0; axis < 3; ++axis) {
        const std::vector<float> more = columnsOf(own, axis, densitiesAlong(own, axis), 1, aligned);
        depths.insert(depths.end(), more.begin(), more.end());
    }
    return blockedArea(depths, 1).first;
}

BlockedFactors::BlockedFactors(const SourcePart& own, double blocked, const SourcePart& spread,
                               double low, double high)
{
    if (own.voxels.empty()) return;
    low = std::clamp(low, 0.05, kLargeStep);
    high = std::clamp(high, low, kLargeStep);
    if (columnCount(own, 1) > kMostColumns || columnCount(spread, high) > kMostColumns) return;
    const int nodes = high > 1.05 * low ? 3 : 1;
    std::vector<double> steps;
    steps.reserve(std::size_t(nodes));
    for (int n = 0; n < nodes; ++n)
        steps.push_back(nodes == 1 ? low : low * std::pow(high / low, n / (nodes - 1.0)));
    const std::vector<std::vector<float>> depths = columnsOf(spread, steps);
    for (std::size_t n = 0; n < steps.size(); ++n) {
        const double columns_per_own = steps[n] * own.voxel / spread.voxel;
        m_nodes.push_back(
            {steps[n], factorFor(depths[n], 2 * blocked * columns_per_own * columns_per_own)});
    }
}

double BlockedFactors::at(double step) const
{
    if (m_nodes.empty()) return 1;
    if (step > kLargeStep) return 1 + (at(kLargeStep) - 1) * kLargeStep / step;
    const auto above =
        std::find_if(m_nodes.begin(), m_nodes.end(), [&](const Node& n) { return n.step >= step; });
    if (above == m_nodes.begin()) return above->factor;
    const Node& below = *(above - 1);
    if (above == m_nodes.end()) return below.factor;
    const double t = (step - below.step) / (above->step - below.step);
    return below.factor + t * (above->factor - below.factor);
}

} // namespace volcomp
