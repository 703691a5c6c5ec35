// SPDX-License-Identifier: Apache-2.0
#include "volcomp/bake/leaf_filler.h"

#include <algorithm>
#include <cmath>

#include "volcomp/base/interval.h"
#include "volcomp/base/portable_math.h"

namespace volcomp {
namespace {

/// Radius in voxels from which on a round strand is more than its axis.
constexpr double kSpreadFrom = 0.125;

/// Radius in voxels from which on a round strand is filled by distance. There the blur of its
/// border reaches its axis, see thickRadius().
const double kThick = std::sqrt(1.0 / 3);

/// Half a voxel, and what thickRadius() exceeds the radius by: at most 0.02.
constexpr double kBlur = 0.55;

/// Returns the radius to fill for a strand of `radius` voxels, at least kThick. The ramp that blurs
/// its border, one voxel wide, adds pi/12 to the area pi r^2 of a disc. Rays that graze the border
/// pass several of its voxels, the more the larger the radius, so that the strand looks thicker
/// than it is.
double thickRadius(double radius)
{
    return std::sqrt(std::max(0.25, radius * radius - 1.0 / 12)) - 0.1
        - 0.13 * portable::log(radius) + 0.05 * portable::exp((kThick - radius) / 0.08);
}

SymmetricTensor tensorOf(const Vec3d& direction)
{
    SymmetricTensor tensor;
    tensor.add(1, direction);
    return tensor;
}

/// Returns the mean over all directions across an axis, given the axis' own: normals all around it.
SymmetricTensor acrossOf(const SymmetricTensor& axis)
{
    return {0.5 * (1 - axis.xx), 0.5 * (1 - axis.yy), 0.5 * (1 - axis.zz),
            -0.5 * axis.xy,      -0.5 * axis.xz,      -0.5 * axis.yz};
}

} // namespace

// Voxels of one strand stand behind each other in the way of rays that run along it, and a strand
// thicker than 1/8 crosses several voxels side by side; -ln(1 - c) counts them as strands at random
// places, which let more light through. Fitted once, under directed extinction, to exactly traced
// cylinders.
double roundFactor(double radius)
{
    return 1 + 0.3 * radius + 0.15 * std::max(0.0, radius - kSpreadFrom)
        - 0.8 * std::max(0.0, radius - 0.45);
}

// Its pieces shade each other only beside it and not behind, so it takes more of them to
// block the same light, for a wide one twice as many. Fitted once, under directed extinction, to
// exactly traced leaves of 0.05 to 10 voxels at random places and angles.
double flatFactor(double width) { return 1 + 0.115 * width / (1 + 0.1 * width); }

double reachInCells(const Segment& s, double size)
{
    if (!s.flat() && size < kSpreadFrom) return 0;
    return s.flat() || size < kThick ? size : size + kBlur;
}

/// A segment of nonzero length, in cells.
struct LeafFiller::Piece {
    const Segment& segment;
    CellLine line;
    Vec3d axis;            ///< unit
    double length;         ///< of the axis
    double size_a, size_b; ///< radius, or half the width of a flat piece

    double largest() const { return std::max(size_a, size_b); }
};

LeafFiller::LeafFiller(const std::vector<Segment>& segments, MaterialKind kind, double voxel)
    : m_segments(segments), m_kind(kind), m_voxel(voxel)
{
}

void LeafFiller::begin(const openvdb::Coord& origin)
{
    m_cells.fill(Cell{});
    m_low = Vec3d(origin[0], origin[1], origin[2]);
    m_touched = 0;
    m_strand = ~0U;
}

void LeafFiller::add(std::uint32_t index)
{
    const Segment& s = m_segments[index];
    if (s.strand != m_strand) finishStrand();
    m_strand = s.strand;
    const CellLine line = inCells(s, m_voxel);
    const double length = line.d.length();
    if (length == 0) return;
    const Piece piece{s, line, line.d / length, length, s.size_a / m_voxel, s.size_b / m_voxel};
    if (s.flat()) {
        addFlat(piece);
        return;
    }
    // A tapered strand is thick up to the point at which its radius is kThick.
    const bool thick_a = piece.size_a >= kThick, thick_b = piece.size_b >= kThick;
    const double change =
        thick_a == thick_b ? 0 : (kThick - piece.size_a) / (piece.size_b - piece.size_a);
    if (thick_a || thick_b) addThick(piece, {thick_a ? 0 : change, thick_b ? 1 : change});
    if (!thick_a || !thick_b) addThin(piece, {thick_a ? change : 0, thick_b ? change : 1});
}

void LeafFiller::finishStrand()
{
    for (int k = 0; k < m_touched; ++k) {
        Cell& cell = m_cells[m_touched_list[k]];
        const auto depth =
            static_cast<float>(-portable::log1p(-std::min<double>(cell.coverage, kMaxCoverage)));
        cell.depth += depth;
        cell.squares += depth * depth;
        cell.coverage = 0;
    }
    m_touched = 0;
}

/// A round piece of less than kThick, as one line or, from kSpreadFrom on, as several lines that
/// are spread evenly over its cross-section.
void LeafFiller::addThin(const Piece& piece, LineRange range)
{
    SymmetricTensor tensor = tensorOf(piece.axis);
    if (m_kind == MaterialKind::surface) tensor = acrossOf(tensor);
    // (pi/4) 2 r l in voxels, or the volume pi r^2 l if that is more
    const double sizes = piece.size_a + piece.size_b;
    const double per_length =
        kPi / 2 * piece.length * std::max(1.0, sizes) * roundFactor(0.5 * sizes);
    if (piece.largest() < kSpreadFrom) {
        walk(piece, piece.line, range, per_length * piece.size_a, per_length * piece.size_b,
             tensor);
        return;
    }
    const int lines = piece.largest() < 0.25 ? 4 : 12;
    Vec3d u = piece.axis.cross(std::abs(piece.axis[0]) < 0.7 ? Vec3d(1, 0, 0) : Vec3d(0, 0, 1));
    u.normalize();
    const Vec3d v = piece.axis.cross(u);
    for (int k = 0; k < lines; ++k) {
        const double r = std::sqrt((k + 0.5) / lines), phi = k * kGoldenAngle;
        const Vec3d offset = u * (r * portable::cos(phi)) + v * (r * portable::sin(phi));
        const Vec3d a = piece.line.a + offset * piece.size_a,
                    b = piece.line.a + piece.line.d + offset * piece.size_b;
        walk(piece, {a, b - a}, range, per_length * piece.size_a / lines,
             per_length * piece.size_b / lines, tensor);
    }
}

/// A flat piece, as lines side by side that are at most 0.4 voxels apart.
void LeafFiller::addFlat(const Piece& piece)
{
    const Vec3d side(piece.segment.side);
    const SymmetricTensor tensor =
        tensorOf(m_kind == MaterialKind::surface ? piece.axis.cross(side) : piece.axis);
    const double width = 2 * piece.largest();
    const int lines = std::max(1, static_cast<int>(std::ceil(width / 0.4)));
    const double per_length = piece.length * flatFactor(width) / lines; // area / 2, in voxels
    for (int k = 0; k < lines; ++k) {
        const double offset = (2 * k + 1.0) / lines - 1;
        const Vec3d a = piece.line.a + side * (offset * piece.size_a),
                    b = piece.line.a + piece.line.d + side * (offset * piece.size_b);
        walk(piece, {a, b - a}, {0, 1}, per_length * piece.size_a, per_length * piece.size_b,
             tensor);
    }
}

/// Deposits a line whose coverage per t changes linearly from w_a to w_b, in each cell exactly its
/// part. The planes between cells are compared in one space for all leaves, so that two leaves
/// share a line without gap or overlap.
void LeafFiller::walk(const Piece& piece, const CellLine& line, LineRange range, double w_a,
                      double w_b, const SymmetricTensor& tensor)
{
    range = clippedToBox(range, line.a, line.d, m_low, m_low + Vec3d(kLeaf));
    if (!(range.begin < range.end)) return;
    int cell[3], step[3];
    double next[3];
    const auto planeAhead = [&](int k) {
        return (m_low[k] + cell[k] + (step[k] > 0) - line.a[k]) / line.d[k];
    };
    for (int k = 0; k < 3; ++k) {
        const double p = line.a[k] + line.d[k] * range.begin - m_low[k];
        step[k] = line.d[k] < 0 ? -1 : 1;
        int c = static_cast<int>(std::floor(p));
        if (line.d[k] < 0 && p == c) --c;
        cell[k] = std::clamp(c, 0, kLeaf - 1);
        next[k] = line.d[k] == 0 ? kInfinity : planeAhead(k);
    }
    for (double t = range.begin; t < range.end;) {
        const int k = smallestOf(next);
        const double end = std::min(next[k], range.end);
        if (end > t) {
            const double middle = 0.5 * (t + end);
            deposit((cell[0] << 6) | (cell[1] << 3) | cell[2],
                    (end - t) * (w_a + (w_b - w_a) * middle), piece.segment, middle, tensor);
            t = end;
        }
        if (end >= range.end) break;
        cell[k] += step[k];
        if (cell[k] < 0 || cell[k] >= kLeaf) break;
        next[k] = planeAhead(k);
    }
}

/// A round piece of at least kThick: every voxel near it gets the part of it that the piece fills.
void LeafFiller::addThick(const Piece& piece, LineRange range)
{
    const CellLine& line = piece.line;
    const Vec3d p0 = line.a + line.d * range.begin, p1 = line.a + line.d * range.end;
    const double reach = piece.largest() + kBlur;
    int low[3], high[3];
    for (int k = 0; k < 3; ++k) {
        low[k] = static_cast<int>(
            std::clamp(std::floor(std::min(p0[k], p1[k]) - reach - m_low[k]), 0.0, 8.0));
        high[k] = static_cast<int>(
            std::clamp(std::floor(std::max(p0[k], p1[k]) + reach - m_low[k]), -1.0, 7.0));
    }
    const SymmetricTensor along_axis = tensorOf(piece.axis), around_axis = acrossOf(along_axis);
    const auto addVoxel = [&](int x, int y, int z) {
        const Vec3d p = m_low + Vec3d(x + 0.5, y + 0.5, z + 0.5);
        const double along = (p - line.a).dot(piece.axis),
                     t = std::clamp(along / piece.length, range.begin, range.end);
        const Vec3d out = p - (line.a + line.d * t);
        const double distance = out.length();
        // A plane that cuts a cube, averaged over directions, covers it by a ramp; a linear ramp
        // one voxel wide has the same mean and variance.
        const double radius = piece.size_a + (piece.size_b - piece.size_a) * t;
        double c = std::clamp(0.5 + thickRadius(radius) - distance, 0.0, 1.0);
        if (range.begin > 0) c *= std::clamp(0.5 + along - range.begin * piece.length, 0.0, 1.0);
        if (range.end < 1) c *= std::clamp(0.5 + range.end * piece.length - along, 0.0, 1.0);
        if (c <= 0) return;
        const int index = (x << 6) | (y << 3) | z;
        const double added = c - m_cells[index].coverage; // pieces of one strand are joined
        if (added <= 0) return;
        deposit(index, added, piece.segment, t,
                m_kind != MaterialKind::surface ? along_axis
                    : distance > 1e-6           ? tensorOf(out / distance)
                                                : around_axis);
    };
    for (int x = low[0]; x <= high[0]; ++x)
        for (int y = low[1]; y <= high[1]; ++y)
            for (int z = low[2]; z <= high[2]; ++z) addVoxel(x, y, z);
}

void LeafFiller::deposit(int index, double coverage, const Segment& s, double t,
                         const SymmetricTensor& tensor)
{
    Cell& cell = m_cells[index];
    if (cell.coverage == 0) m_touched_list[m_touched++] = static_cast<std::uint16_t>(index);
    const float c = static_cast<float>(coverage), f = static_cast<float>(t);
    cell.coverage += c;
    cell.weight += c;
    for (int k = 0; k < 3; ++k)
        cell.colour[k] += c * (s.colour_a[k] + (s.colour_b[k] - s.colour_a[k]) * f);
    cell.tensor[0] += c * static_cast<float>(tensor.xx);
    cell.tensor[1] += c * static_cast<float>(tensor.yy);
    cell.tensor[2] += c * static_cast<float>(tensor.zz);
    cell.tensor[3] += c * static_cast<float>(tensor.xy);
    cell.tensor[4] += c * static_cast<float>(tensor.xz);
    cell.tensor[5] += c * static_cast<float>(tensor.yz);
    if (cell.coverage == 0) --m_touched; // the coverage was less than a float holds
}

} // namespace volcomp
