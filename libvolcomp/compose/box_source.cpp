// SPDX-License-Identifier: Apache-2.0
#include "volcomp/compose/box_source.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include <fmt/format.h>

#include "volcomp/base/error.h"
#include "volcomp/base/node_index.h"
#include "volcomp/compose/coarsen.h"

namespace volcomp {

namespace {

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

SourceBounds united(const SourceBounds& a, const SourceBounds& b)
{
    const Vec3f low = openvdb::math::minComponent(a.centre - a.half, b.centre - b.half),
                high = openvdb::math::maxComponent(a.centre + a.half, b.centre + b.half);
    return {(low + high) * 0.5f, (high - low) * 0.5f};
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

} // namespace

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

void reserve(SourcePart& part, std::size_t count)
{
    part.voxels.reserve(count);
    for (std::vector<float>* c : {&part.x, &part.y, &part.z})
        c->reserve((count + SourcePart::kRun - 1) / SourcePart::kRun * SourcePart::kRun);
}

void append(SourcePart& part, const Vec3f& place, const SourceVoxel& v)
{
    part.x.push_back(place[0]);
    part.y.push_back(place[1]);
    part.z.push_back(place[2]);
    part.voxels.push_back(v);
}

std::uint64_t mortonKey(std::int32_t x, std::int32_t y, std::int32_t z)
{
    const auto biased = [](std::int32_t v) {
        return everyThirdBit(std::uint64_t(std::int64_t(v) + (1 << 20)));
    };
    return biased(x) << 2 | biased(y) << 1 | biased(z);
}

void setBounds(SourcePart& s)
{
    s.bounds_of.clear();
    if (s.voxels.empty()) return;
    constexpr auto kTogether = static_cast<std::size_t>(BoundsList::kTogether);
    std::vector<SourceBounds> members = boundsOfRuns(s);
    for (std::vector<float>* c : {&s.x, &s.y, &s.z}) {
        c->reserve(members.size() * SourcePart::kRun); // no more than that
        c->resize(members.size() * SourcePart::kRun, 1e30f);
        c->shrink_to_fit();
    }
    s.voxels.shrink_to_fit();
    s.squares.shrink_to_fit();
    s.scatter_ratios.shrink_to_fit();
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
    const auto count = static_cast<std::size_t>(density->activeVoxelCount());
    reserve(s, count);
    if (part.own_share) s.squares.reserve(count);
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

} // namespace volcomp
