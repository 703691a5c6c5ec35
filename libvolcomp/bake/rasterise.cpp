#include "volcomp/bake/rasterise.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <memory>
#include <mutex>

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include "volcomp/base/portable_math.h"
#include "volcomp/base/principal_direction.h"
#include "volcomp/base/error.h"

namespace volcomp {
namespace {

using FloatLeaf = openvdb::FloatTree::LeafNodeType;
using VectorLeaf = openvdb::Vec3STree::LeafNodeType;

constexpr int kLeaf = 8, kLeafVoxels = 512;
constexpr double kMaxCoverage = 0.99;
constexpr int kMaxCoordinate = 1 << 20;
constexpr float kLeastDepth =
    1e-5f; ///< of a voxel; less is neither seen nor does it fit half floats
constexpr double kSpreadFrom =
    0.125; ///< radius in voxels from which a round strand is more than its axis
/// Radius in voxels from which a round strand is filled by distance; there its border's blur
/// reaches its axis, see thickRadius().
const double kThick = std::sqrt(1.0 / 3);

/// What multiplies the coverage of a round strand of `radius` voxels. Up to an eighth nothing does.
/// Above, a strand that crosses several voxels side by side in a ray's way would let light through
/// as if it were several strands, each at random: -ln(1 - c) is for those. Fitted once, with
/// thickRadius(), to exactly traced cylinders with radii of 1/4 to 4 voxels: what they block is
/// right within 2 %, where without the two it is up to 12 % too little or too much.
double roundFactor(double radius) { return 1 + 0.5 * std::max(0.0, radius - kSpreadFrom); }

/// The radius to fill for a strand of `radius` voxels, at least kThick. The ramp that blurs its
/// border, one voxel wide, adds pi/12 to the area of a disc pi r^2; and rays that graze the border
/// pass several of its voxels, the more the larger the radius, so that it looks larger than it is.
double thickRadius(double radius)
{
    return std::sqrt(std::max(0.25, radius * radius - 1.0 / 12)) - 0.1 - 0.13 * portable::log(radius)
        + 0.1 * portable::exp((kThick - radius) / 0.08);
}

/// What multiplies area / (2 h^2), the mean projected area, for a flat shape `width` voxels wide.
/// Where it is wider than a voxel its pieces shade each other only beside it, not behind, so it
/// takes more to block what it blocks; 2 in the limit. Fitted once to the transmittance of 3000
/// leaves, randomly placed and turned, traced exactly at widths of 1 to 6 voxels: error of the mean
/// below 0.006.
double flatFactor(double width) { return 1 + std::max(0.0, (width - 1) / (width + 6)); }

/// Axis in cells: voxel (i,j,k) is the cell [i, i+1)^3, half a voxel away from OpenVDB's index
/// space.
struct Line {
    Vec3d a, d; ///< start, and the way to the end
};

/// Which segments touch which leaf.
struct Pair {
    std::uint64_t leaf;
    std::uint32_t segment;
    bool operator<(const Pair& o) const
    {
        return leaf != o.leaf ? leaf < o.leaf : segment < o.segment;
    }
};

std::uint64_t packed(int x, int y, int z)
{
    const auto part = [](int v) {
        return static_cast<std::uint64_t>(v + (kMaxCoordinate >> 3)) & 0x1fffff;
    };
    return part(x) << 42 | part(y) << 21 | part(z);
}

openvdb::Coord unpacked(std::uint64_t key)
{
    const auto part = [](std::uint64_t v) {
        return (static_cast<int>(v & 0x1fffff) - (kMaxCoordinate >> 3)) * kLeaf;
    };
    return {part(key >> 42), part(key >> 21), part(key)};
}

/// Clips t to where the line is inside the slab [low, high) of each axis. False where nothing is
/// left.
bool clip(const Line& line, const Vec3d& low, const Vec3d& high, double& t0, double& t1)
{
    for (int k = 0; k < 3; ++k) {
        if (line.d[k] == 0) {
            if (line.a[k] < low[k] || line.a[k] >= high[k]) return false;
            continue;
        }
        const double u = (low[k] - line.a[k]) / line.d[k], v = (high[k] - line.a[k]) / line.d[k];
        t0 = std::max(t0, std::min(u, v));
        t1 = std::min(t1, std::max(u, v));
    }
    return t0 < t1;
}

/// What is known of a voxel while its leaf is being filled.
struct Cell {
    float depth = 0;    ///< sum of -ln(1 - c) over the finished strands
    float coverage = 0; ///< of the current strand
    float weight = 0;   ///< sum of coverages
    std::array<float, 3> colour{};
    std::array<float, 6> tensor{};
};

/// Fills one leaf at a time.
class LeafFiller {
public:
    LeafFiller(const std::vector<Segment>& segments, MaterialKind kind, double voxel)
        : m_segments(segments), m_kind(kind), m_voxel(voxel)
    {
    }

    void begin(const openvdb::Coord& origin)
    {
        m_cells.fill(Cell{});
        m_low = Vec3d(origin[0], origin[1], origin[2]);
        m_touched = 0;
        m_strand = ~0U;
    }

    void add(std::uint32_t index)
    {
        const Segment& s = m_segments[index];
        if (s.strand != m_strand) finishStrand();
        m_strand = s.strand;
        const Vec3d a = inCells(s.a), d = inCells(s.b) - a;
        const double length = d.length();
        if (length == 0) return;
        const Vec3d axis = d / length;
        const double size_a = s.size_a / m_voxel, size_b = s.size_b / m_voxel;
        if (s.flat()) {
            addFlat(s, {a, d}, axis, length, size_a, size_b);
            return;
        }
        // a tapered strand is thick up to where its radius is kThick
        const bool thick_a = size_a >= kThick, thick_b = size_b >= kThick;
        const double change = thick_a == thick_b ? 0 : (kThick - size_a) / (size_b - size_a);
        if (thick_a || thick_b) {
            const double t0 = thick_a ? 0 : change, t1 = thick_b ? 1 : change;
            addThick(s, {a, d}, axis, length, size_a, size_b, t0, t1);
        }
        if (!thick_a || !thick_b)
            addThin(s, {a, d}, axis, length, size_a, size_b, thick_a ? change : 0,
                    thick_b ? change : 1);
    }

    void finishStrand()
    {
        for (int k = 0; k < m_touched; ++k) {
            Cell& cell = m_cells[m_touched_list[k]];
            cell.depth -=
                static_cast<float>(portable::log1p(-std::min<double>(cell.coverage, kMaxCoverage)));
            cell.coverage = 0;
        }
        m_touched = 0;
    }

    const std::array<Cell, kLeafVoxels>& cells() const { return m_cells; }

private:
    Vec3d inCells(const Vec3f& p) const { return Vec3d(p) / m_voxel + Vec3d(0.5); }

    void addThin(const Segment& s, const Line& line, const Vec3d& axis, double length,
                 double size_a, double size_b, double t0, double t1)
    {
        SymmetricTensor tensor;
        tensor.add(1, axis);
        if (m_kind == MaterialKind::surface) // normals all around the axis
            tensor = {0.5 * (1 - tensor.xx), 0.5 * (1 - tensor.yy), 0.5 * (1 - tensor.zz),
                      -0.5 * tensor.xy,      -0.5 * tensor.xz,      -0.5 * tensor.yz};
        const double largest = std::max(size_a, size_b);
        // (pi/4) 2 r l in voxels, or where that is less the volume pi r^2 l
        const double per_length = kPi / 2 * length * std::max(1.0, size_a + size_b)
            * roundFactor(0.5 * (size_a + size_b));
        if (largest < kSpreadFrom) {
            walk(s, line, t0, t1, per_length * size_a, per_length * size_b, tensor);
            return;
        }
        const int lines = largest < 0.25 ? 4 : 12; // evenly over the cross-section
        Vec3d u = axis.cross(std::abs(axis[0]) < 0.7 ? Vec3d(1, 0, 0) : Vec3d(0, 0, 1));
        u.normalize();
        const Vec3d v = axis.cross(u);
        for (int k = 0; k < lines; ++k) {
            const double r = std::sqrt((k + 0.5) / lines), phi = k * kGoldenAngle;
            const Vec3d offset = u * (r * portable::cos(phi)) + v * (r * portable::sin(phi));
            const Vec3d a = line.a + offset * size_a, b = line.a + line.d + offset * size_b;
            walk(s, {a, b - a}, t0, t1, per_length * size_a / lines, per_length * size_b / lines,
                 tensor);
        }
    }

    void addFlat(const Segment& s, const Line& line, const Vec3d& axis, double length,
                 double size_a, double size_b)
    {
        const Vec3d side(s.side);
        SymmetricTensor tensor;
        tensor.add(1, m_kind == MaterialKind::surface ? axis.cross(side) : axis);
        const double largest = std::max(size_a, size_b);
        const int lines = std::max(1, static_cast<int>(std::ceil(2 * largest / 0.4)));
        const double per_length = length * flatFactor(2 * largest) / lines; // area / 2, in voxels
        for (int k = 0; k < lines; ++k) {
            const double offset = (2 * k + 1.0) / lines - 1;
            const Vec3d a = line.a + side * (offset * size_a),
                        b = line.a + line.d + side * (offset * size_b);
            walk(s, {a, b - a}, 0, 1, per_length * size_a, per_length * size_b, tensor);
        }
    }

    /// Deposits a line whose coverage per t runs linearly from w_a to w_b, in each cell exactly its
    /// part. Planes between cells are compared in one space for all leaves, so that two leaves
    /// share a line without gap or overlap.
    void walk(const Segment& s, const Line& line, double t0, double t1, double w_a, double w_b,
              const SymmetricTensor& tensor)
    {
        if (!clip(line, m_low, m_low + Vec3d(kLeaf), t0, t1)) return;
        int cell[3], step[3];
        double next[3];
        for (int k = 0; k < 3; ++k) {
            const double p = line.a[k] + line.d[k] * t0 - m_low[k];
            step[k] = line.d[k] < 0 ? -1 : 1;
            int c = static_cast<int>(std::floor(p));
            if (line.d[k] < 0 && p == c) --c;
            cell[k] = std::clamp(c, 0, kLeaf - 1);
            next[k] = line.d[k] == 0 ? HUGE_VAL
                                     : (m_low[k] + cell[k] + (step[k] > 0) - line.a[k]) / line.d[k];
        }
        for (double t = t0; t < t1;) {
            const int k =
                next[0] <= next[1] ? (next[0] <= next[2] ? 0 : 2) : (next[1] <= next[2] ? 1 : 2);
            const double end = std::min(next[k], t1);
            if (end > t) {
                const double middle = 0.5 * (t + end);
                deposit((cell[0] << 6) | (cell[1] << 3) | cell[2],
                        (end - t) * (w_a + (w_b - w_a) * middle), s, middle, tensor);
                t = end;
            }
            if (end >= t1) break;
            cell[k] += step[k];
            if (cell[k] < 0 || cell[k] >= kLeaf) break;
            next[k] = (m_low[k] + cell[k] + (step[k] > 0) - line.a[k]) / line.d[k];
        }
    }

    void addThick(const Segment& s, const Line& line, const Vec3d& axis, double length,
                  double size_a, double size_b, double t0, double t1)
    {
        const Vec3d p0 = line.a + line.d * t0, p1 = line.a + line.d * t1;
        const double reach =
            std::max(size_a, size_b) + 0.55; // thickRadius() exceeds the radius by up to 0.02
        int low[3], high[3];
        for (int k = 0; k < 3; ++k) {
            low[k] = static_cast<int>(
                std::clamp(std::floor(std::min(p0[k], p1[k]) - reach - m_low[k]), 0.0, 8.0));
            high[k] = static_cast<int>(
                std::clamp(std::floor(std::max(p0[k], p1[k]) + reach - m_low[k]), -1.0, 7.0));
        }
        SymmetricTensor tensor;
        tensor.add(1, axis);
        for (int x = low[0]; x <= high[0]; ++x)
            for (int y = low[1]; y <= high[1]; ++y)
                for (int z = low[2]; z <= high[2]; ++z) {
                    const Vec3d p = m_low + Vec3d(x + 0.5, y + 0.5, z + 0.5);
                    const double along = (p - line.a).dot(axis),
                                 t = std::clamp(along / length, t0, t1);
                    const Vec3d out = p - (line.a + line.d * t);
                    const double distance = out.length();
                    // a plane cuts a cube, averaged over directions: a ramp one voxel wide has the
                    // same mean and variance
                    const double radius = size_a + (size_b - size_a) * t;
                    double c = std::clamp(0.5 + thickRadius(radius) - distance, 0.0, 1.0);
                    if (t0 > 0) c *= std::clamp(0.5 + along - t0 * length, 0.0, 1.0);
                    if (t1 < 1) c *= std::clamp(0.5 + t1 * length - along, 0.0, 1.0);
                    if (c <= 0) continue;
                    const int index = (x << 6) | (y << 3) | z;
                    const double more = c - m_cells[index].coverage;
                    if (more <= 0) continue;
                    if (m_kind == MaterialKind::surface && distance > 1e-6) {
                        tensor = {};
                        tensor.add(1, out / distance);
                    }
                    deposit(index, more, s, t, tensor);
                }
    }

    void deposit(int index, double coverage, const Segment& s, double t,
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
        if (cell.coverage == 0) --m_touched; // less than a float holds
    }

    const std::vector<Segment>& m_segments;
    MaterialKind m_kind;
    double m_voxel;
    Vec3d m_low{0.0};
    std::array<Cell, kLeafVoxels> m_cells;
    std::array<std::uint16_t, kLeafVoxels> m_touched_list;
    int m_touched = 0;
    std::uint32_t m_strand = ~0U;
};

/// Calls f(leaf key) for each leaf that the segment may touch.
template <class F>
void forLeaves(const Segment& s, double voxel, F&& f)
{
    const Vec3d a = (Vec3d(s.a) / voxel + Vec3d(0.5)) / kLeaf,
                b = (Vec3d(s.b) / voxel + Vec3d(0.5)) / kLeaf;
    const double size = std::max(s.size_a, s.size_b) / voxel;
    const double reach =
        (s.flat() || size >= kSpreadFrom ? size + (size >= kThick && !s.flat() ? 0.55 : 0) : 0)
            / kLeaf
        + 1e-9;
    const Line line{a, b - a};
    int low[3], high[3];
    for (int k = 0; k < 3; ++k) {
        low[k] = static_cast<int>(std::floor(std::min(a[k], b[k]) - reach));
        high[k] = static_cast<int>(std::floor(std::max(a[k], b[k]) + reach));
    }
    const bool single = low[0] == high[0] && low[1] == high[1] && low[2] == high[2];
    for (int x = low[0]; x <= high[0]; ++x)
        for (int y = low[1]; y <= high[1]; ++y)
            for (int z = low[2]; z <= high[2]; ++z) {
                double t0 = 0, t1 = 1 + 1e-12;
                if (single
                    || clip(line, Vec3d(x, y, z) - Vec3d(reach),
                            Vec3d(x + 1, y + 1, z + 1) + Vec3d(reach), t0, t1))
                    f(packed(x, y, z));
            }
}

std::vector<Pair> findPairs(const std::vector<Segment>& segments, double voxel)
{
    constexpr std::size_t kChunk = 4096;
    const std::size_t chunks = (segments.size() + kChunk - 1) / kChunk;
    std::vector<std::size_t> first(chunks + 1, 0);
    const auto each = [&](auto&& work) {
        tbb::parallel_for(std::size_t(0), chunks, [&](std::size_t chunk) {
            work(chunk, chunk * kChunk, std::min(segments.size(), (chunk + 1) * kChunk));
        });
    };
    each([&](std::size_t chunk, std::size_t begin, std::size_t end) {
        std::size_t count = 0;
        for (std::size_t i = begin; i < end; ++i)
            forLeaves(segments[i], voxel, [&](std::uint64_t) { ++count; });
        first[chunk + 1] = count;
    });
    for (std::size_t c = 0; c < chunks; ++c) first[c + 1] += first[c];
    std::vector<Pair> pairs(first.back());
    each([&](std::size_t chunk, std::size_t begin, std::size_t end) {
        std::size_t at = first[chunk];
        for (std::size_t i = begin; i < end; ++i)
            forLeaves(segments[i], voxel, [&](std::uint64_t leaf) {
                pairs[at++] = {leaf, static_cast<std::uint32_t>(i)};
            });
    });
    tbb::parallel_sort(pairs.begin(), pairs.end());
    return pairs;
}

void check(const std::vector<Segment>& segments, double voxel)
{
    if (!(voxel >= kSmallestVoxel) || !std::isfinite(voxel))
        throw Error(fmt::format(
            "the voxel of a box: expected a length of at least {:g} m, found {:g} m; write smaller things in millimetres",
            kSmallestVoxel, voxel));
    double farthest = 0;
    for (const Segment& s : segments) {
        for (int k = 0; k < 3; ++k)
            farthest = std::max({farthest, std::abs(double(s.a[k])), std::abs(double(s.b[k]))});
        if (!(s.a + s.b + s.side + s.colour_a + s.colour_b).isFinite()
            || !std::isfinite(s.size_a + s.size_b) || s.size_a < 0 || s.size_b < 0)
            throw Error(fmt::format(
                "strand {} of a box has a position, size or colour that is not finite or is negative",
                s.strand));
        farthest = std::max({farthest, double(s.size_a), double(s.size_b)});
    }
    if (farthest / voxel > kMaxCoordinate / 2)
        throw Error(fmt::format(
            "a box reaches {:.4g} m from its root, more than {} voxels of {:.4g} m; a larger voxel is needed",
            farthest, kMaxCoordinate / 2, voxel));
}

bool oneColour(const std::vector<Segment>& segments)
{
    return std::all_of(segments.begin(), segments.end(), [&](const Segment& s) {
        return s.colour_a == segments.front().colour_a && s.colour_b == segments.front().colour_a;
    });
}

} // namespace

VolumePart rasterise(const std::vector<Segment>& segments, const std::string& material,
                     MaterialKind kind, double voxel, const Progress& progress)
{
    check(segments, voxel);
    VolumePart part;
    part.material = material;
    part.kind = kind;
    part.density = openvdb::FloatGrid::create(0.0f);
    part.density->setTransform(openvdb::math::Transform::createLinearTransform(voxel));
    part.density->setGridClass(openvdb::GRID_FOG_VOLUME);
    part.direction = openvdb::Vec3SGrid::create(Vec3f(0.0f));
    part.direction->setTransform(part.density->transform().copy());
    const bool with_colour = !segments.empty() && !oneColour(segments);
    if (with_colour) {
        part.colour = openvdb::Vec3SGrid::create(Vec3f(0.0f));
        part.colour->setTransform(part.density->transform().copy());
    } else if (!segments.empty()) {
        part.uniform_colour = segments.front().colour_a;
    }

    const std::vector<Pair> pairs = findPairs(segments, voxel);
    std::vector<std::size_t> groups; // where each leaf's pairs start
    for (std::size_t i = 0; i < pairs.size(); ++i)
        if (i == 0 || pairs[i].leaf != pairs[i - 1].leaf) groups.push_back(i);
    groups.push_back(pairs.size());
    const std::size_t leaves = groups.size() - 1;

    std::vector<std::unique_ptr<FloatLeaf>> densities(leaves);
    std::vector<std::unique_ptr<VectorLeaf>> directions(leaves), colours(with_colour ? leaves : 0);
    std::atomic<std::size_t> done{0};
    std::mutex reporting;
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, leaves, 4),
        [&](const tbb::blocked_range<std::size_t>& range) {
            const auto filler = std::make_unique<LeafFiller>(segments, kind, voxel);
            for (std::size_t g = range.begin(); g < range.end(); ++g) {
                const openvdb::Coord origin = unpacked(pairs[groups[g]].leaf);
                filler->begin(origin);
                for (std::size_t i = groups[g]; i < groups[g + 1]; ++i)
                    filler->add(pairs[i].segment);
                filler->finishStrand();
                for (int v = 0; v < kLeafVoxels; ++v) {
                    const Cell& cell = filler->cells()[static_cast<std::size_t>(v)];
                    if (!(cell.depth > kLeastDepth)) continue;
                    if (!densities[g]) {
                        densities[g] = std::make_unique<FloatLeaf>(origin, 0.0f, false);
                        directions[g] = std::make_unique<VectorLeaf>(origin, Vec3f(0.0f), false);
                        if (with_colour)
                            colours[g] = std::make_unique<VectorLeaf>(origin, Vec3f(0.0f), false);
                    }
                    const auto offset = static_cast<openvdb::Index>(v);
                    densities[g]->setValueOn(offset, static_cast<float>(cell.depth / voxel));
                    const auto& m = cell.tensor;
                    directions[g]->setValueOn(
                        offset,
                        Vec3f(principalDirection({m[0], m[1], m[2], m[3], m[4], m[5]}).stored()));
                    if (with_colour)
                        colours[g]->setValueOn(offset, Vec3f(cell.colour.data()) / cell.weight);
                }
            }
            done += range.size();
            if (const std::unique_lock lock(reporting, std::try_to_lock); lock)
                report(progress, double(done) / double(leaves));
        });
    for (std::size_t g = 0; g < leaves; ++g) {
        if (!densities[g]) continue;
        part.density->tree().addLeaf(densities[g].release());
        part.direction->tree().addLeaf(directions[g].release());
        if (with_colour) part.colour->tree().addLeaf(colours[g].release());
    }
    report(progress, 1);
    return part;
}

} // namespace volcomp
