// SPDX-License-Identifier: Apache-2.0
#include "volcomp/curves/curve_pieces.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "volcomp/base/error.h"
#include "volcomp/curves/hilbert.h"

namespace volcomp {
namespace {

Vec3d toDouble(const Vec3f& v) { return Vec3d(v); }

} // namespace

CurvePieces::CurvePieces(const GrowthRule& rule)
    : m_spec(rule.curves.value()), m_material(rule.material), m_set(readCurves(m_spec.file))
{
    m_scale = m_spec.axes.scale > 0 ? m_spec.axes.scale : m_set.unit > 0 ? m_set.unit : 1;
    m_up = m_spec.axes.up.value_or(m_set.says_up ? m_set.up : UpAxis::y);
    if (m_spec.groom) m_middle = turnedUp(m_up, m_set.offset) * m_scale + m_spec.move;
    if (!m_spec.colour_map.empty()) m_map = readTexture(m_spec.colour_map, true);
    checkKeys();
    choose();
    cut(rule.variants);
    findOrigins();
}

void CurvePieces::checkKeys() const
{
    if (m_set.widths.given == Given::never && !(m_spec.width > 0))
        throw fileError(m_spec.file, "", "widths of strands", "none",
                        "Say how thick they are with the key 'width'.");
    if (!m_spec.colour_map.empty() && m_set.root_uvs.empty())
        throw fileError(m_spec.file, "", "texture coordinates of roots for 'colour_map'", "none",
                        "Leave 'colour_map' out.");
}

void CurvePieces::choose()
{
    const auto wanted = [&](std::size_t s) {
        if (!m_spec.use_guides && !m_set.guides.empty() && m_set.guides[s]) return false;
        const std::int32_t group = m_set.groups.empty() ? 0 : m_set.groups[s];
        return m_spec.groups.empty()
            || std::find(m_spec.groups.begin(), m_spec.groups.end(), group) != m_spec.groups.end();
    };
    for (std::size_t s = 0; s < m_set.size(); ++s) {
        if (!wanted(s)) continue;
        m_strands.push_back(s);
        m_segments += m_set.ends[s] - m_set.first(s) - 1;
    }
    if (m_strands.empty())
        throw fileError(m_spec.file, "", "strands of the wanted groups that are no guides", "none",
                        "Check 'groups', or take the guides with guides = \"use\".");
}

void CurvePieces::cut(int pieces)
{
    Vec3f low(m_set.points[m_set.first(m_strands[0])]), high(low);
    for (const std::size_t s : m_strands) {
        low = openvdb::math::minComponent(low, m_set.points[m_set.first(s)]);
        high = openvdb::math::maxComponent(high, m_set.points[m_set.first(s)]);
    }
    const Vec3d size(toDouble(high) - toDouble(low));
    const double cell = std::max({size[0], size[1], size[2], 1e-300}) / ((1 << 21) - 1);
    std::vector<std::pair<std::uint64_t, std::size_t>> order;
    order.reserve(m_strands.size());
    for (const std::size_t s : m_strands) {
        const Vec3d at = (toDouble(m_set.points[m_set.first(s)]) - toDouble(low)) / cell;
        order.emplace_back(
            hilbertIndex({std::uint32_t(at[0]), std::uint32_t(at[1]), std::uint32_t(at[2])}), s);
    }
    std::sort(order.begin(), order.end());
    // A strand belongs to the piece that holds the middle of its segments.
    m_ends.assign(std::size_t(pieces), 0);
    std::size_t before = 0;
    for (std::size_t i = 0; i < order.size(); ++i) {
        const std::size_t s = order[i].second, count = m_set.ends[s] - m_set.first(s) - 1;
        m_strands[i] = s;
        const double middle = (double(before) + 0.5 * double(count)) / double(m_segments);
        const auto piece = std::min(std::size_t(middle * pieces), std::size_t(pieces) - 1);
        m_ends[piece] = i + 1;
        before += count;
    }
    for (std::size_t k = 1; k < m_ends.size(); ++k) m_ends[k] = std::max(m_ends[k], m_ends[k - 1]);
}

void CurvePieces::findOrigins()
{
    m_origins.assign(m_ends.size(), Vec3d(0.0));
    m_frames.resize(m_ends.size());
    for (int piece = 0; piece < count(); ++piece) {
        const std::size_t first = firstOf(piece), end = m_ends[std::size_t(piece)];
        if (first == end) continue;
        Frame& frame = m_frames[std::size_t(piece)];
        Vec3d way(0.0), low(1e300), high(-1e300);
        for (std::size_t i = first; i < end; ++i) {
            const std::size_t root = m_set.first(m_strands[i]);
            const Vec3d at = turned(m_set.points[root]) * m_scale,
                        next = turned(m_set.points[root + 1]) * m_scale;
            low = openvdb::math::minComponent(low, at);
            high = openvdb::math::maxComponent(high, at);
            frame.root += at / double(end - first);
            if (const double length = (next - at).length(); length > 0) way += (next - at) / length;
        }
        if (m_spec.groom) {
            frame.root = (low + high) / 2;
            m_origins[std::size_t(piece)] = m_middle + frame.root;
            continue;
        }
        if (way.length() < 1e-9) continue;
        frame.y = way.unit(); // turned by the smallest angle
        const Vec3d side = std::abs(frame.y[0]) < 0.9 ? Vec3d(1, 0, 0) : Vec3d(0, 0, -1);
        frame.z = side.cross(frame.y).unit();
        frame.x = frame.y.cross(frame.z);
    }
}

Vec3d CurvePieces::turned(const Vec3f& v) const { return turnedUp(m_up, Vec3d(v)); }

double CurvePieces::radius(std::size_t strand, std::size_t point) const
{
    const bool own = m_set.widths.given == Given::per_strand
        || m_set.widths.given == Given::per_point || !(m_spec.width > 0);
    return 0.5 * (own ? double(m_set.widths.at(strand, point)) * m_scale : m_spec.width);
}

Vec3f CurvePieces::colour(std::size_t strand, std::size_t point) const
{
    const PerCurve<Vec3f>& own = m_set.colours;
    const bool of_strands = own.given == Given::per_strand || own.given == Given::per_point;
    const bool is_default = own.given == Given::once && !m_spec.colour_root;
    Vec3f colour(0.5f);
    if (m_spec.file_colours && (of_strands || is_default)) colour = own.at(strand, point);
    else if (m_spec.colour_root) {
        const std::size_t first = m_set.first(strand), last = m_set.ends[strand] - 1;
        const double f = double(point - first) / double(last - first);
        const Vec3d& root = *m_spec.colour_root;
        colour = Vec3f(root * (1 - f) + m_spec.colour_tip.value_or(root) * f);
    }
    if (m_map.pixels.empty()) return colour;
    const Vec2f& uv = m_set.root_uvs[strand];
    return colour * m_map.colour(uv[0], uv[1], Wrap::repeat);
}

Skeleton CurvePieces::skeleton(int piece) const
{
    const Frame& frame = m_frames[std::size_t(piece)];
    const auto local = [&](std::size_t p) {
        const Vec3d from = turned(m_set.points[p]) * m_scale - frame.root;
        return Vec3f(Vec3d(from.dot(frame.x), from.dot(frame.y), from.dot(frame.z)));
    };
    SkeletonPart part{m_material, {}};
    std::uint32_t strand = 0;
    for (std::size_t i = firstOf(piece); i < m_ends[std::size_t(piece)]; ++i, ++strand) {
        const std::size_t s = m_strands[i], first = m_set.first(s), end = m_set.ends[s];
        Segment segment;
        segment.strand = strand;
        segment.b = local(first);
        segment.size_b = float(radius(s, first));
        segment.colour_b = colour(s, first);
        for (std::size_t p = first + 1; p < end; ++p) {
            segment.a = segment.b, segment.size_a = segment.size_b;
            segment.colour_a = segment.colour_b;
            segment.b = local(p);
            segment.size_b = float(radius(s, p));
            segment.colour_b = colour(s, p);
            if (segment.a != segment.b && (segment.size_a > 0 || segment.size_b > 0))
                part.segments.push_back(segment);
        }
    }
    return {std::move(part)};
}

BoxContents::BoxContents(const GrowthRule& rule) : m_rule(rule)
{
    if (rule.curves) m_curves.emplace(rule);
}

Skeleton BoxContents::skeleton(int variant) const
{
    return m_curves ? m_curves->skeleton(variant) : grow(m_rule, variant);
}

} // namespace volcomp
