// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/march/segment_light.h"

#include <algorithm>
#include <cmath>

#include "volcomp/base/interval.h"

namespace volcomp {
namespace {

Vec3d pointAt(const RaySegment& segment, double u)
{
    return segment.p_begin + u * (segment.p_end - segment.p_begin);
}

/// How exact the light of a segment has to be; docs/rendering.md says what each costs and brings.
/// The first three are fractions of what the pixel shows so far, with the piece.
struct Tolerance {
    double constant; ///< a piece that adds no more takes the light at its middle
    double line;     ///< three places lie on a line if the sum changes by no more when each third
                     ///< has its own
    double sure;     ///< a segment that adds no more is not cut if its three places lie on a line
    double floor;    ///< added to the first two: a fraction of what the segment would show if it
                     ///< were opaque and lit
    int levels;      ///< how often a piece is cut in three, at most
};
// Under the trilinear filter light falls off fastest where fog begins, in a corner of its cell.
constexpr Tolerance kExactLight{0.01, 0.003, 0.1, 1e-4, 5}, kSweptLight{0.15, 0.03, 1, 1e-4, 1},
    kSweptTrilinearLight{0.15, 0.03, 1, 1e-4, 2};

/// A place in the segment where the optical depth to the light is known.
struct Known {
    double x;     ///< share of the segment's own optical depth before it
    double depth; ///< to the light
};
double slope(const Known& from, const Known& to)
{
    return (to.depth - from.depth) / (to.x - from.x);
}

/// The sum over one segment and light.
class SegmentSum {
public:
    SegmentSum(const MarchScene& scene, std::size_t light, const RaySegment& segment,
               double opacity, double start, RayCounts& counts)
        : m_scene(scene), m_light(light), m_segment(segment), m_opacity(opacity), m_start(start),
          m_counts(counts)
    {
    }

    /// Returns the sum. What it is multiplied by in the pixel is `scale`, and the pixel shows
    /// `shown` before it.
    double integrate(double scale, double shown, const Tolerance& tolerance, LightOnRay& state)
    {
        m_scale = scale;
        m_shown = shown;
        m_tolerance = tolerance;
        const double most = m_scale * m_opacity; // what the segment adds if nothing shades it
        const Known middle = lookUp(0.5);
        const double guess = slopeAlongRay(middle, state);
        if (most < limit(m_tolerance.constant, m_shown + most)) return piece(0, 1, middle, guess);
        double ends[5] = {0}; // of the pieces (4 at most), as shares of what the segment shows
        const int pieces = 1 + findCuts(ends + 1);
        if (pieces == 1) return integrate(0, 1, middle, guess, 0);
        ends[pieces] = 1;
        double sum = 0;
        for (int i = 0; i < pieces; ++i)
            sum += integrate(ends[i], ends[i + 1], lookUp(0.5 * (ends[i] + ends[i + 1])), guess, 0);
        return sum;
    }
    /// The share of the segment's own depth before the share v of what it shows.
    double shareOfDepth(double v) const
    {
        constexpr double kThin = 1e-6; // where the two are the same
        if (m_segment.delta < kThin) return v;
        return std::min(1.0, -std::log1p(-v * m_opacity) / m_segment.delta);
    }

private:
    Known lookUp(double v) const
    {
        const double x = shareOfDepth(v);
        return {x, depthAt(pointAt(m_segment, placeAtShare(m_segment, x)))};
    }
    // All optical depths of a segment come from here.
    double depthAt(Vec3d p) const
    {
        constexpr double kInside = 1e-9; // of a voxel from its faces: far above rounding
        int cell[3];
        for (int a = 0; a < 3; ++a)
            if (m_scene.dual) cell[a] = int(std::floor(p[a])); // D has no jumps
            else {
                cell[a] = m_segment.cell[a];
                p[a] = std::min(std::max(p[a], cell[a] + kInside), cell[a] + (1 - kInside));
            }
        return depthFromStart(m_scene, m_light, m_start, cell, p, m_counts);
    }
    double limit(double fraction, double shown) const
    {
        return fraction * shown + m_tolerance.floor;
    }

    // How the depth to the light changes with the share of the segment's depth, if the last places
    // on the ray lie on a line with its middle, as they do in a homogeneous body; 0 if not. Updates
    // the state.
    double slopeAlongRay(const Known& middle, LightOnRay& state) const
    {
        constexpr double kSame = 1e-6;
        const double length = m_segment.end - m_segment.t,
                     t = m_segment.t + length * placeAtShare(m_segment, middle.x);
        LightOnRay::Before now{t, middle.depth, kInfinity};
        bool same = false;
        if (state.before && t > state.before->t) {
            now.slope = (now.depth - state.before->depth) / (t - state.before->t);
            same = std::abs(now.slope - state.before->slope) <= kSame * (1 + std::abs(now.slope));
        }
        state.before = now;
        return same ? now.slope * length : 0;
    }

    // Finds where the segment has to be cut if the light comes nearly along an axis: where its way
    // begins to leave the column of voxels before it leaves the volume. Behind that the depth goes
    // over into that of the next column, often within a small part of a voxel.
    int findCuts(double* cuts) const
    {
        if (m_scene.dual || m_scene.sweep) return 0; // no jumps; not known so exactly
        Vec3d middle = pointAt(m_segment, 0.5);
        const Vec3d along = m_segment.p_end - m_segment.p_begin;
        const WayToLight way = wayToLight(m_scene.grid_lights[m_light], middle);
        middle += m_start * way.direction; // columns do not change with it
        const openvdb::CoordBBox& box = m_scene.tree.bounds();
        double length = way.length;
        for (int a = 0; a < 3; ++a)
            if (way.direction[a] != 0)
                length = std::min(
                    length,
                    ((way.direction[a] > 0 ? box.max()[a] + 1.0 : box.min()[a]) - middle[a])
                        / way.direction[a]);
        int count = 0;
        for (int a = 0; a < 3; ++a) {
            const double sideways = way.direction[a] * length;
            if (sideways == 0 || !(std::abs(sideways) < 1) || along[a] == 0) continue;
            const double at = m_segment.cell[a] + (sideways > 0 ? 1 - sideways : -sideways),
                         u = (at - m_segment.p_begin[a]) / along[a];
            if (u > 0 && u < 1) cuts[count++] = -std::expm1(-m_segment.delta * u) / m_opacity;
        }
        for (int i = 1; i < count; ++i) // at most three
            for (int k = i; k > 0 && cuts[k] < cuts[k - 1]; --k) std::swap(cuts[k], cuts[k - 1]);
        return count;
    }
    // The piece from share x0 to x1 of the segment's depth, if the depth to the light goes linearly
    // through `known`.
    double piece(double x0, double x1, const Known& known, double slope) const
    {
        const double a = std::max(0.0, known.depth + slope * (x0 - known.x)),
                     b = std::max(0.0, known.depth + slope * (x1 - known.x)),
                     delta = m_segment.delta * (x1 - x0);
        return std::exp(-m_segment.delta * x0) * delta * segmentLight(a, delta + b - a);
    }
    // The piece from share v0 to v1 of what the segment shows, of which the middle is known.
    double integrate(double v0, double v1, const Known& middle, double guess, int level) const
    {
        const double x0 = shareOfDepth(v0), x1 = shareOfDepth(v1),
                     simple = piece(x0, x1, middle, guess), shown = m_shown + m_scale * simple;
        // The light may be found at places that are as much brighter as a voxel of this density is
        // dark. The sweep is not so exact, and pieces of a piece have seen its neighbours.
        const double brighter =
            level > 0 || m_scene.sweep ? 0 : m_segment.delta / (m_segment.end - m_segment.t);
        const double most = std::max(
            simple, m_opacity * (v1 - v0) * std::exp(std::min(0.0, brighter - middle.depth)));
        if (level == m_tolerance.levels || m_scale * most < limit(m_tolerance.constant, shown))
            return simple;
        const double third = (v1 - v0) / 3, va = v0 + third, vb = v1 - third, xa = shareOfDepth(va),
                     xb = shareOfDepth(vb);
        const Known first = lookUp(v0 + 0.5 * third), last = lookUp(v1 - 0.5 * third);
        const double before = slope(first, middle), behind = slope(middle, last),
                     across = slope(first, last);
        const double sum = piece(x0, xa, first, before) + piece(xa, xb, middle, across)
            + piece(xb, x1, last, behind);
        const double change = std::abs(sum - piece(x0, x1, middle, across));
        if (m_scale * change < limit(m_tolerance.line, shown)
            && (level > 0 || m_scale * sum <= m_tolerance.sure * shown))
            return sum;
        return integrate(v0, va, first, before, level + 1)
            + integrate(va, vb, middle, across, level + 1)
            + integrate(vb, v1, last, behind, level + 1);
    }

    const MarchScene& m_scene;
    const std::size_t m_light;
    const RaySegment& m_segment;
    const double m_opacity, m_start; ///< Shading::light_start
    RayCounts& m_counts;
    double m_scale = 1, m_shown = 0;
    Tolerance m_tolerance{};
};

// The transmittance to a light, the same in the whole segment, where little depends on it or the
// sweep knows no better; empty if the light has to be looked at more closely. `weight` is the share
// of the pixel that shows the segment, `p` a place in it. With `rough`, whatever the sweep knows
// will do.
std::optional<double> approximateTransmittance(const MarchScene& scene, std::size_t light,
                                               const RaySegment& segment, const Vec3d& p,
                                               double start, double weight, LightOnRay& state,
                                               bool rough = false)
{
    constexpr double kTrace = 0.001; // a segment of less weight takes the light of another
    constexpr double kReuse = 2;     // that is not farther away than this, voxels
    if (weight >= kTrace || !state.approximate
        || std::abs(segment.t - state.approximate->t) > kReuse) {
        const WayToLight way = wayToLight(scene.grid_lights[light], p);
        if (!(way.length > start)) return 1;
        const Vec3d from = p + start * way.direction;
        const int there[3] = {floorToInt(from[0]), floorToInt(from[1]), floorToInt(from[2])};
        const auto found = scene.sweep->approximateTransmittance(
            scene.shadow_of[light], start == 0 ? segment.cell : there, from, way.direction,
            way.length - start);
        if (!found) return {};
        state.approximate = {segment.t, found->value, found->fine};
    }
    const LightOnRay::Approximate& known = *state.approximate;
    if (!rough && known.fine && weight * known.transmittance >= ShadowSweep::kFineWeight) return {};
    return known.transmittance;
}

double depthOf(double transmittance)
{
    return transmittance > 0 ? -std::log(transmittance) : kInfinity;
}

} // namespace

SegmentLight lightOfSegment(const MarchScene& scene, std::size_t l, const RaySegment& segment,
                            double opacity, const RaySample& sample, RayScratch& scratch)
{
    if (scene.params.shadows == Shadows::none) return {opacity, 0};
    const double start = scratch.shading.light_start[l];
    if (scene.params.integration == Integration::riemann) {
        const double depth =
            depthFromStart(scene, l, start, segment.cell, segment.p_begin, scratch.counts);
        return {segment.delta * std::exp(-depth), depth};
    }
    const Vec3d& from_light = scratch.shading.from_light[l];
    const double weight = sample.transmittance * opacity;
    SegmentSum sum(scene, l, segment, opacity, start, scratch.counts);
    if (scene.sweep)
        if (const auto passes = approximateTransmittance(scene, l, segment, pointAt(segment, 0.5),
                                                         start, weight, scratch.lights[l]))
            return {opacity * *passes, depthOf(*passes)};
    const double total = from_light[0] + from_light[1] + from_light[2],
                 shown = (sample.radiance[0] + sample.radiance[1] + sample.radiance[2]) / total;
    LightOnRay& state = scratch.lights[l];
    const double light = sum.integrate(sample.transmittance, shown,
                                       !scene.sweep     ? kExactLight
                                           : scene.dual ? kSweptTrilinearLight
                                                        : kSweptLight,
                                       state);
    return {light, state.before->depth};
}

double depthOfSegment(const MarchScene& scene, std::size_t l, const RaySegment& segment,
                      double weight, RayScratch& scratch)
{
    if (scene.params.shadows == Shadows::none) return 0;
    const double start = scratch.shading.light_start[l];
    const Vec3d p = pointAt(segment, 0.5);
    if (scene.sweep && scene.params.integration == Integration::exact)
        if (const auto passes = approximateTransmittance(scene, l, segment, p, start, weight,
                                                         scratch.lights[l], true))
            return depthOf(*passes);
    return depthFromStart(scene, l, start, segment.cell, p, scratch.counts);
}

double placeAtShare(const RaySegment& segment, double x)
{
    const double* c = segment.profile;
    if (c[1] == 0 && c[2] == 0 && c[3] == 0) return x;
    double low = 0, high = 1, u = x;
    for (int i = 0; i < 40; ++i) { // Newton's method, kept between two bounds
        const double density = c[0] + u * (c[1] + u * (c[2] + u * c[3])),
                     before = u * (c[0] + u * (c[1] / 2 + u * (c[2] / 3 + u * c[3] / 4)));
        (before < x ? low : high) = u;
        double next = density > 0 ? u - (before - x) / density : -1;
        if (!(next > low && next < high)) next = 0.5 * (low + high);
        if (std::abs(next - u) < 1e-9) return next;
        u = next;
    }
    return u;
}

} // namespace volcomp
