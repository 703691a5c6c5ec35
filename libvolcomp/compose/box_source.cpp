// SPDX-License-Identifier: Apache-2.0
#include "volcomp/compose/box_source.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <tuple>

#include <fmt/format.h>

#include "volcomp/base/error.h"
#include "volcomp/base/node_index.h"
#include "volcomp/base/principal_direction.h"

namespace volcomp {

namespace {

/// Sets v and iso from a stored direction, whose length is 1 - spread. Without a direction (length
/// 0) the sum is the same in all directions. v.density() must be set.
void setDirection(SourceVoxel& v, const Vec3f& d)
{
    v.iso() = v.density() / 3;
    const float length = d.length();
    if (!(length > 1e-6f)) return;
    const float spread = std::max(0.0f, 1 - length);
    const float largest = v.density() / (1 + 2 * spread * spread); // the largest eigenvalue
    const float along = std::sqrt(std::max(0.0f, largest * (1 - spread * spread))) / length;
    for (int i = 0; i < 3; ++i) v.direction()[i] = along * d[i];
    v.iso() = largest * spread * spread;
}

void append(SourcePart& part, const Vec3f& place, const SourceVoxel& v)
{
    part.x.push_back(place[0]);
    part.y.push_back(place[1]);
    part.z.push_back(place[2]);
    part.voxels.push_back(v);
}

SourceBounds united(const SourceBounds& a, const SourceBounds& b)
{
    const Vec3f low = openvdb::math::minComponent(a.centre - a.half, b.centre - b.half),
                high = openvdb::math::maxComponent(a.centre + a.half, b.centre + b.half);
    return {(low + high) * 0.5f, (high - low) * 0.5f};
}

/// Moves the lowest 21 bits apart: bit i becomes bit 3 i.
std::uint64_t everyThirdBit(std::uint64_t v)
{
    v &= 0x1fffff;
    v = (v | v << 32) & 0x1f00000000ffff;
    v = (v | v << 16) & 0x1f0000ff0000ff;
    v = (v | v << 8) & 0x100f00f00f00f00f;
    v = (v | v << 4) & 0x10c30c30c30c30c3;
    return (v | v << 2) & 0x1249249249249249;
}

/// The bits of the coordinates in turn (Morton, A computer oriented geodetic data base, 1966).
/// Voxels that are sorted by this key have their neighbours close in the list. For coordinates from
/// -2^20 to 2^20 - 1.
std::uint64_t mortonKey(std::int32_t x, std::int32_t y, std::int32_t z)
{
    const auto biased = [](std::int32_t v) {
        return everyThirdBit(std::uint64_t(std::int64_t(v) + (1 << 20)));
    };
    return biased(x) << 2 | biased(y) << 1 | biased(z);
}

void append(BoundsList& list, const SourceBounds& b)
{
    for (int i = 0; i < 3; ++i) {
        list.values[i].push_back(b.centre[i]);
        list.values[3 + i].push_back(b.half[i]);
    }
}

/// Bounds of each kRun voxels' cubes.
std::vector<SourceBounds> boundsOfRuns(const SourcePart& s)
{
    constexpr auto kRun = static_cast<std::size_t>(SourcePart::kRun);
    const std::size_t count = s.voxels.size();
    std::vector<SourceBounds> bounds;
    for (std::size_t begin = 0; begin < count; begin += kRun) {
        Vec3f low(std::numeric_limits<float>::max()), high(-std::numeric_limits<float>::max());
        for (std::size_t k = begin; k < std::min(begin + kRun, count); ++k) {
            const Vec3f p(s.x[k], s.y[k], s.z[k]);
            low = openvdb::math::minComponent(low, p);
            high = openvdb::math::maxComponent(high, p);
        }
        bounds.push_back({(low + high) * 0.5f, (high - low) * 0.5f + Vec3f(0.5f)});
    }
    return bounds;
}

/// Finds the bounds of runs, of groups and of all, and pads the lists. To be called when all voxels
/// are in `s`.
void setBounds(SourcePart& s)
{
    s.bounds_of.clear();
    if (s.voxels.empty()) return;
    constexpr auto kTogether = static_cast<std::size_t>(BoundsList::kTogether);
    std::vector<SourceBounds> members = boundsOfRuns(s);
    for (std::vector<float>* c : {&s.x, &s.y, &s.z})
        c->resize(members.size() * SourcePart::kRun, 1e30f);
    do {
        BoundsList& list = s.bounds_of.emplace_back();
        std::vector<SourceBounds> groups;
        for (std::size_t i = 0; i < members.size(); ++i) {
            append(list, members[i]);
            if (i % kTogether == 0) groups.push_back(members[i]);
            else groups.back() = united(groups.back(), members[i]);
        }
        while (list.size() % kTogether != 0) append(list, {Vec3f(0.0f), Vec3f(-1e30f)});
        members = std::move(groups);
    } while (members.size() > 1);
    s.bounds = members[0];
}

using Leaf = openvdb::FloatTree::LeafNodeType;

/// The leaves of a tree, sorted so that neighbours are close.
std::vector<const Leaf*> leavesInMortonOrder(const openvdb::FloatTree& tree)
{
    std::vector<std::pair<std::uint64_t, const Leaf*>> keys;
    for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) {
        const openvdb::Coord c = leaf->origin();
        keys.emplace_back(mortonKey(c[0] >> 3, c[1] >> 3, c[2] >> 3), leaf.getLeaf());
    }
    std::stable_sort(keys.begin(), keys.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    std::vector<const Leaf*> leaves;
    leaves.reserve(keys.size());
    for (const auto& [key, leaf] : keys) leaves.push_back(leaf);
    return leaves;
}

/// The numbers of a leaf's voxels, sorted so that neighbours are close.
std::array<openvdb::Index, kLeafSize> voxelsInMortonOrder()
{
    std::array<openvdb::Index, kLeafSize> order{};
    for (openvdb::Index i = 0; i < kLeafSize; ++i) {
        const openvdb::Coord c = Leaf::offsetToLocalCoord(i);
        order[mortonKey(c[0], c[1], c[2]) & (kLeafSize - 1)] = i;
    }
    return order;
}

/// Voxels are counted in 32 bits, and a group of them must not wrap.
constexpr double kMostVoxels = 4294967296.0 - SourcePart::kRun * BoundsList::kTogether;

/// Throws if the part has more voxels than a SourcePart holds: active tiles of a small file may
/// stand for any number.
void checkCount(const openvdb::FloatGrid& grid, const std::string& place)
{
    const auto count = static_cast<double>(grid.activeVoxelCount());
    if (count > kMostVoxels)
        throw Error(
            fmt::format("{}expected at most {:.0f} voxels, found {:.0f}; a larger voxel needs "
                        "fewer",
                        place, kMostVoxels, count));
}

/// Throws if the voxels are not cubes or voxel (0,0,0) is not at the origin. `place` begins the
/// message.
void checkTransform(const openvdb::FloatGrid& grid, const std::string& place)
{
    const double voxel = grid.voxelSize()[0];
    const openvdb::Vec3d origin = grid.transform().indexToWorld(openvdb::Vec3d(0.0));
    const openvdb::Vec3d one = grid.transform().indexToWorld(openvdb::Vec3d(1.0)) - origin;
    if (!(voxel > 0) || (one - openvdb::Vec3d(voxel)).length() > 1e-6 * voxel
        || origin.length() > 1e-6 * voxel)
        throw Error(
            place
            + "expected cubic voxels whose (0,0,0) lies at the origin, found another transform");
}

/// Makes voxels of a part's grids.
class VoxelReader {
public:
    VoxelReader(const VolumePart& part, std::string place)
        : m_uniform(part.uniform_colour), m_place(std::move(place))
    {
        if (part.direction) m_direction.emplace(part.direction->getConstAccessor());
        if (part.colour) m_colour.emplace(part.colour->getConstAccessor());
        if (part.own_share) m_own_share.emplace(part.own_share->getConstAccessor());
    }

    SourceVoxel read(const openvdb::Coord& c, float density)
    {
        SourceVoxel v;
        v.density() = density;
        setDirection(v, m_direction ? m_direction->getValue(c) : openvdb::Vec3s(0.0f));
        const openvdb::Vec3s rgb = m_colour ? m_colour->getValue(c) : m_uniform;
        for (int i = 0; i < 3; ++i) {
            v.colour()[i] = density * rgb[i];
            if (!std::isfinite(v.colour()[i] + v.direction()[i]))
                throw Error(m_place + "expected finite colours and directions, found others");
        }
        return v;
    }
    float readSquares(const openvdb::Coord& c, float density)
    {
        const float share = m_own_share ? m_own_share->getValue(c) : 0;
        if (!std::isfinite(share))
            throw Error(m_place + "expected finite own shares, found others");
        return std::clamp(share, 0.0f, 1.0f) * density * density;
    }

private:
    std::optional<openvdb::Vec3SGrid::ConstAccessor> m_direction, m_colour;
    std::optional<openvdb::FloatGrid::ConstAccessor> m_own_share;
    Vec3f m_uniform;
    std::string m_place; ///< begins messages
};

/// A voxel of a part and the coarser voxel into which it falls.
struct Fine {
    std::uint64_t key; ///< mortonKey() of the coarser voxel
    std::array<std::int32_t, 3> coarse;
    std::uint32_t voxel;

    bool operator<(const Fine& other) const
    {
        return std::tie(key, coarse, voxel) < std::tie(other.key, other.coarse, other.voxel);
    }
};

/// All voxels of a part, those of one coarser voxel together.
std::vector<Fine> sortedByCoarse(const SourcePart& part)
{
    const auto coarse = [&](float x) {
        return static_cast<std::int32_t>(std::floor(double(x) / 2 + part.shift / 2));
    };
    std::vector<Fine> fine;
    fine.reserve(part.voxels.size());
    for (std::size_t k = 0; k < part.voxels.size(); ++k) {
        const std::array<std::int32_t, 3> c{coarse(part.x[k]), coarse(part.y[k]),
                                            coarse(part.z[k])};
        fine.push_back({mortonKey(c[0], c[1], c[2]), c, static_cast<std::uint32_t>(k)});
    }
    std::sort(fine.begin(), fine.end());
    return fine;
}

/// Whether two voxels of a part are likely to hold the same strand: their directions agree, and it
/// goes from one to the other.
float sameStrand(const SourcePart& part, std::uint32_t i, std::uint32_t j)
{
    constexpr float kApart = 0.85f; // voxels; those of a diagonal strand's stairs are closer
    const Vec3f a(part.voxels[i].direction()), b(part.voxels[j].direction());
    const float ab = a.dot(b), squares = a.lengthSqr() * b.lengthSqr();
    if (!(squares > 0)) return 0;
    const float agree = std::max(0.0f, 2 * ab * ab / squares - 1);
    if (agree == 0) return 0;
    const Vec3f way(part.x[j] - part.x[i], part.y[j] - part.y[i], part.z[j] - part.z[i]);
    const float along = way.dot(a) * way.dot(a) / a.lengthSqr(),
                apart = part.kind == MaterialKind::fibre ? way.lengthSqr() - along : along;
    return apart < kApart * kApart ? agree : 0;
}

/// The sum over strands of the square of their density, added up over the voxels [begin, end).
float squaresOf(const SourcePart& part, const Fine* begin, const Fine* end)
{
    float sum = 0;
    for (const Fine* f = begin; f != end; ++f) {
        const float own = part.squares[f->voxel];
        sum += own;
        for (const Fine* g = begin; g != f; ++g)
            sum +=
                2 * std::sqrt(own * part.squares[g->voxel]) * sameStrand(part, f->voxel, g->voxel);
    }
    return sum;
}

/// Which halves of a coarser voxel a voxel of it lies in, along each axis: 0 or 1.
std::array<int, 3> halvesOf(const SourcePart& part, const Fine& f)
{
    const float place[3] = {part.x[f.voxel], part.y[f.voxel], part.z[f.voxel]};
    std::array<int, 3> upper{};
    for (int a = 0; a < 3; ++a)
        upper[a] = static_cast<int>(std::floor(double(place[a]) + part.shift)) - 2 * f.coarse[a];
    return upper;
}

/// The voxels [begin, end) of one coarser voxel.
EightVoxels eightOf(const SourcePart& part, const Fine* begin, const Fine* end)
{
    EightVoxels eight;
    for (const Fine* f = begin; f != end; ++f) {
        const std::array<int, 3> upper = halvesOf(part, *f);
        const int k = 4 * upper[0] + 2 * upper[1] + upper[2];
        const double density = double(part.voxels[f->voxel].density());
        eight.densities[k] = density;
        if (!part.scatter_ratios.empty()) eight.scatter_ratios[k] = part.scatter_ratios[f->voxel];
        if (!part.squares.empty())
            eight.own_shares[k] =
                part.ownWeight() * double(part.squares[f->voxel]) / (density * density);
    }
    if (part.squares.empty()) return eight;
    for (const Fine* f = begin; f != end; ++f)
        for (const Fine* g = begin; g != f; ++g) {
            const std::array<int, 3> a = halvesOf(part, *f), b = halvesOf(part, *g);
            const int i = 4 * a[0] + 2 * a[1] + a[2], j = 4 * b[0] + 2 * b[1] + b[2],
                      axis = (i ^ j) == 4 ? 0
                : (i ^ j) == 2            ? 1
                : (i ^ j) == 1            ? 2
                                          : -1;
            if (axis < 0) continue;
            eight.same_beside[i][axis] = eight.same_beside[j][axis] =
                std::sqrt(eight.own_shares[i] * eight.own_shares[j])
                * double(sameStrand(part, f->voxel, g->voxel));
        }
    return eight;
}

/// What is left of the density of the voxels [begin, end) in a voxel of twice the edge that lets as
/// much light through as the columns of voxels along each axis, mean over the axes (MODEL section
/// 8), over their mean density.
float keptDensity(const SourcePart& from, const Fine* begin, const Fine* end)
{
    double depths[3][4] = {}; // of the columns along each axis
    for (const Fine* f = begin; f != end; ++f) {
        const std::uint32_t k = f->voxel;
        const std::array<int, 3> upper = halvesOf(from, *f);
        for (int a = 0; a < 3; ++a)
            depths[a][2 * upper[(a + 1) % 3] + upper[(a + 2) % 3]] +=
                from.depthAlong(k, a) * from.voxel;
    }
    double kept = 0, sum = 0;
    for (const auto& columns : depths) {
        const double least = *std::min_element(columns, columns + 4); // e^-least may underflow
        double passes = 0;
        for (const double depth : columns) {
            passes += std::exp(least - depth) / 4;
            sum += depth / 4;
        }
        kept += least - std::log(passes);
    }
    return sum > 0 ? static_cast<float>(kept / sum) : 1;
}

/// Appends the sum of the voxels [begin, end) of `from` as one voxel of twice the edge, at their
/// centre of mass.
void appendSum(const SourcePart& from, const Fine* begin, const Fine* end, bool keep_blocked,
               SourcePart& to)
{
    SourceVoxel sum;
    SymmetricTensor tensor;
    Vec3d moment(0.0);
    for (const Fine* f = begin; f != end; ++f) {
        const std::uint32_t k = f->voxel;
        const SourceVoxel& v = from.voxels[k];
        sum.density() += v.density() / 8;
        moment += Vec3d(from.x[k], from.y[k], from.z[k]) * (v.density() / 16.0);
        tensor.add(1, Vec3d(v.direction()[0], v.direction()[1], v.direction()[2]));
        tensor.xx += v.iso(), tensor.yy += v.iso(), tensor.zz += v.iso();
        for (int c = 0; c < 3; ++c) sum.colour()[c] += v.colour()[c] / 8;
    }
    const Vec3f place(moment / sum.density());
    const float kept = keep_blocked ? keptDensity(from, begin, end) : 1;
    sum.density() *= kept;
    for (int c = 0; c < 3; ++c) sum.colour()[c] *= kept;
    setDirection(sum, Vec3f(principalDirection(tensor).stored()));
    append(to, place, sum);
    float squares = 0;
    if (!from.squares.empty()) {
        squares = squaresOf(from, begin, end) / 64;
        to.squares.push_back(kept * kept * squares);
    }
    if (!keep_blocked) return;
    const float mean = sum.density() / kept;
    to.scatter_ratios.push_back(scatterRatioOf(
        eightOf(from, begin, end), double(sum.density()),
        from.ownWeight() * double(std::min(1.0f, squares / (mean * mean))), from.voxel));
}

/// Calls f(begin, end) for the voxels of each coarser voxel.
template <class F>
void forEachCoarse(const std::vector<Fine>& fine, const F& f)
{
    const Fine* const end = fine.data() + fine.size();
    for (const Fine *first = fine.data(), *next; first != end; first = next) {
        next = std::find_if(first, end, [&](const Fine& g) { return g.coarse != first->coarse; });
        f(first, next);
    }
}

/// In how many dimensions the strands of a part go on from voxel to voxel: 0 for specks, 1 for
/// hairs, 2 for wide leaves.
double dimensionOf(const SourcePart& part)
{
    double alone = 0, together = 0; // squares
    forEachCoarse(sortedByCoarse(part), [&](const Fine* begin, const Fine* end) {
        for (const Fine* f = begin; f != end; ++f) alone += double(part.squares[f->voxel]);
        together += double(squaresOf(part, begin, end));
    });
    return alone > 0 ? std::clamp(std::log2(together / alone), 0.0, 2.0) : 1;
}

} // namespace

double SourcePart::ownWeight() const
{
    if (kind == MaterialKind::fibre) return 1;
    const double sheet = std::clamp(dimension - 1, 0.0, 1.0);
    return sheet * sheet;
}

double SourcePart::depthAlong(std::uint32_t k, int axis) const
{
    const SourceVoxel& v = voxels[k];
    const double rho = double(v.density());
    if (!has_direction) return rho;
    const double iso = double(v.iso()), d = double(v.direction()[axis]),
                 largest = double(Vec3f(v.direction()).lengthSqr()) + iso,
                 spread = std::sqrt(iso / largest), square = std::min(1.0, (d * d + iso) / rho);
    // The means over all directions are 1: exactly without spread and at its greatest, and within
    // 1 % between (render/tree/voxel_record.h has the exact ones).
    return kind == MaterialKind::fibre
        ? rho * 4 / kPi * std::sqrt(1 - square) / (1 + 0.0396 * spread)
        : rho * 2 * std::sqrt(square) / (1 + 0.1547 * spread);
}

SourcePart packPart(const VolumePart& part, const std::string& box_name)
{
    const std::string place = "box '" + box_name + "': ";
    checkTransform(*part.density, place);
    checkCount(*part.density, place);
    SourcePart s;
    s.box = box_name;
    s.material = part.material;
    s.kind = part.kind;
    s.has_direction = part.direction != nullptr;
    s.has_colour = part.colour != nullptr;
    s.colour = part.uniform_colour;
    s.voxel = part.density->voxelSize()[0];
    const openvdb::FloatGrid::ConstPtr density = withoutActiveTiles(part.density);
    const std::array<openvdb::Index, kLeafSize> order = voxelsInMortonOrder();
    VoxelReader reader(part, place);
    for (const Leaf* leaf : leavesInMortonOrder(density->tree()))
        for (const openvdb::Index i : order) {
            if (!leaf->isValueOn(i)) continue;
            const float rho = leaf->getValue(i);
            if (!std::isfinite(rho) || rho < 0)
                throw Error(place
                            + "expected densities that are finite and not negative, found others");
            if (rho == 0) continue;
            const openvdb::Coord c = leaf->offsetToGlobalCoord(i);
            append(s, Vec3f(c.asVec3s()), reader.read(c, rho));
            if (part.own_share) s.squares.push_back(reader.readSquares(c, rho));
        }
    if (!s.squares.empty()) s.dimension = dimensionOf(s);
    setBounds(s);
    return s;
}

SourcePart coarsen(const SourcePart& part, Kept keep)
{
    SourcePart s;
    s.box = part.box;
    s.material = part.material;
    s.kind = part.kind;
    s.has_direction = part.has_direction;
    s.has_colour = part.has_colour;
    s.colour = part.colour;
    s.voxel = 2 * part.voxel;
    s.shift = part.shift / 2;
    forEachCoarse(sortedByCoarse(part), [&](const Fine* begin, const Fine* end) {
        appendSum(part, begin, end, keep == Kept::blocked_light, s);
    });
    if (!s.squares.empty()) s.dimension = dimensionOf(s);
    setBounds(s);
    return s;
}

} // namespace volcomp
