#include "volcomp/compose/box_source.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <tuple>

#include "volcomp/base/principal_direction.h"
#include "volcomp/base/error.h"

namespace volcomp {

namespace {

/// Sets a voxel's directions from one of length 1 - spread; from no direction: as much in all.
void setDirection(SourceVoxel& v, const Vec3f& d)
{
    v.iso = v.density / 3;
    const float length = d.length();
    if (!(length > 1e-6f)) return;
    const float spread = std::max(0.0f, 1 - length);
    const float largest = v.density / (1 + 2 * spread * spread); // the largest eigenvalue
    const float along = std::sqrt(std::max(0.0f, largest * (1 - spread * spread))) / length;
    for (int i = 0; i < 3; ++i) v.v[i] = along * d[i];
    v.iso = largest * spread * spread;
}

void append(SourcePart& s, float x, float y, float z, const SourceVoxel& v)
{
    s.x.push_back(x), s.y.push_back(y), s.z.push_back(z);
    s.voxels.push_back(v);
}

SourceBounds united(const SourceBounds& a, const SourceBounds& b)
{
    const Vec3f low = openvdb::math::minComponent(a.centre - a.half, b.centre - b.half),
                high = openvdb::math::maxComponent(a.centre + a.half, b.centre + b.half);
    return {(low + high) * 0.5f, (high - low) * 0.5f};
}

/// Every third bit, for the lowest 21.
std::uint64_t spread(std::uint64_t v)
{
    v &= 0x1fffff;
    v = (v | v << 32) & 0x1f00000000ffff;
    v = (v | v << 16) & 0x1f0000ff0000ff;
    v = (v | v << 8) & 0x100f00f00f00f00f;
    v = (v | v << 4) & 0x10c30c30c30c30c3;
    return (v | v << 2) & 0x1249249249249249;
}

/// The coordinates bit by bit in turn: sorted by it, neighbours stay together (Morton 1966).
std::uint64_t mortonKey(std::int32_t x, std::int32_t y, std::int32_t z)
{
    const auto biased = [](std::int32_t v) {
        return spread(std::uint64_t(std::int64_t(v) + (1 << 20)));
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

/// Pads the lists, and finds the bounds of runs, of their groups and of all.
void setBounds(SourcePart& s)
{
    const std::size_t count = s.voxels.size();
    if (count == 0) return;
    constexpr auto kRun = static_cast<std::size_t>(SourcePart::kRun),
                   kTogether = static_cast<std::size_t>(BoundsList::kTogether);
    std::vector<SourceBounds> members;
    for (std::size_t begin = 0; begin < count; begin += kRun) {
        Vec3f low(std::numeric_limits<float>::max()), high(-std::numeric_limits<float>::max());
        for (std::size_t k = begin; k < std::min(begin + kRun, count); ++k) {
            const Vec3f p(s.x[k], s.y[k], s.z[k]);
            low = openvdb::math::minComponent(low, p);
            high = openvdb::math::maxComponent(high, p);
        }
        members.push_back({(low + high) * 0.5f, (high - low) * 0.5f + Vec3f(0.5f)});
    }
    for (std::vector<float>* c : {&s.x, &s.y, &s.z})
        c->resize((count + kRun - 1) / kRun * kRun, 1e30f);
    s.bounds_of.clear();
    while (true) {
        BoundsList& list = s.bounds_of.emplace_back();
        std::vector<SourceBounds> groups;
        for (std::size_t i = 0; i < members.size(); ++i) {
            append(list, members[i]);
            if (i % kTogether == 0) groups.push_back(members[i]);
            else groups.back() = united(groups.back(), members[i]);
        }
        while (list.size() % kTogether != 0) append(list, {Vec3f(0.0f), Vec3f(-1e30f)});
        members = std::move(groups);
        if (members.size() == 1) break;
    }
    s.bounds = members[0];
}

} // namespace

SourcePart packPart(const VolumePart& part, const std::string& box_name)
{
    const std::string place = "box '" + box_name + "': ";
    SourcePart s;
    s.material = part.material;
    s.kind = part.kind;
    s.has_direction = part.direction != nullptr;
    s.has_colour = part.colour != nullptr;
    s.colour = part.uniform_colour;
    s.voxel = part.density->voxelSize()[0];
    const openvdb::Vec3d origin = part.density->transform().indexToWorld(openvdb::Vec3d(0.0));
    const openvdb::Vec3d one = part.density->transform().indexToWorld(openvdb::Vec3d(1.0)) - origin;
    if (!(s.voxel > 0) || (one - openvdb::Vec3d(s.voxel)).length() > 1e-6 * s.voxel
        || origin.length() > 1e-6 * s.voxel)
        throw Error(
            place
            + "expected cubic voxels whose (0,0,0) lies at the origin, found another transform");

    openvdb::FloatGrid::ConstPtr density = part.density;
    if (density->tree().hasActiveTiles()) {
        const auto copy = density->deepCopy();
        copy->tree().voxelizeActiveTiles();
        density = copy;
    }
    std::optional<openvdb::Vec3SGrid::ConstAccessor> direction, colour;
    if (part.direction) direction.emplace(part.direction->getConstAccessor());
    if (part.colour) colour.emplace(part.colour->getConstAccessor());
    using Leaf = openvdb::FloatTree::LeafNodeType;
    std::vector<std::pair<std::uint64_t, const Leaf*>> leaves;
    for (auto leaf = density->tree().cbeginLeaf(); leaf; ++leaf) {
        const openvdb::Coord c = leaf->origin();
        leaves.emplace_back(mortonKey(c[0] >> 3, c[1] >> 3, c[2] >> 3), leaf.getLeaf());
    }
    std::stable_sort(leaves.begin(), leaves.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    std::array<openvdb::Index, Leaf::SIZE> order; // of a leaf's voxels
    for (openvdb::Index i = 0; i < Leaf::SIZE; ++i) {
        const openvdb::Coord c = Leaf::offsetToLocalCoord(i);
        order[mortonKey(c[0], c[1], c[2]) & (Leaf::SIZE - 1)] = i;
    }
    for (const auto& [key, leaf] : leaves)
        for (const openvdb::Index i : order) {
            if (!leaf->isValueOn(i)) continue;
            const float rho = leaf->getValue(i);
            if (!std::isfinite(rho) || rho < 0)
                throw Error(place
                            + "expected densities that are finite and not negative, found others");
            if (rho == 0) continue;
            const openvdb::Coord c = leaf->offsetToGlobalCoord(i);
            SourceVoxel v;
            v.density = rho;
            setDirection(v, direction ? direction->getValue(c) : openvdb::Vec3s(0.0f));
            const openvdb::Vec3s rgb = colour ? colour->getValue(c) : s.colour;
            for (int a = 0; a < 3; ++a) {
                v.colour[a] = rho * rgb[a];
                if (!std::isfinite(v.colour[a] + v.v[a]))
                    throw Error(place + "expected finite colours and directions, found others");
            }
            append(s, float(c[0]), float(c[1]), float(c[2]), v);
        }
    setBounds(s);
    return s;
}

SourcePart coarsen(const SourcePart& part)
{
    SourcePart s = part;
    s.voxel = 2 * part.voxel;
    s.voxels.clear();
    s.x.clear(), s.y.clear(), s.z.clear();
    struct Cell {
        std::uint64_t key;
        std::int32_t x, y, z;
        std::uint32_t voxel;
    };
    std::vector<Cell> cells;
    for (std::uint32_t k = 0; k < part.voxels.size(); ++k) {
        const auto half = [&](float x) {
            return static_cast<std::int32_t>(std::floor(double(x) / 2 + part.shift / 2));
        };
        const std::int32_t x = half(part.x[k]), y = half(part.y[k]), z = half(part.z[k]);
        cells.push_back({mortonKey(x, y, z), x, y, z, k});
    }
    const auto placeOf = [](const Cell& c) { return std::array<std::int32_t, 3>{c.x, c.y, c.z}; };
    std::sort(cells.begin(), cells.end(), [&](const Cell& a, const Cell& b) {
        return std::make_tuple(a.key, placeOf(a), a.voxel)
            < std::make_tuple(b.key, placeOf(b), b.voxel);
    });
    s.shift = part.shift / 2;
    for (std::size_t i = 0; i < cells.size();) {
        std::size_t end = i;
        SourceVoxel v;
        SymmetricTensor tensor;
        Vec3d moment(0.0);
        while (end < cells.size() && placeOf(cells[end]) == placeOf(cells[i])) {
            const std::uint32_t k = cells[end++].voxel;
            const SourceVoxel& from = part.voxels[k];
            v.density += from.density / 8;
            moment += Vec3d(part.x[k], part.y[k], part.z[k]) * (from.density / 16.0);
            tensor.add(1, Vec3d(from.v[0], from.v[1], from.v[2]));
            tensor.xx += from.iso, tensor.yy += from.iso, tensor.zz += from.iso;
            for (int c = 0; c < 3; ++c) v.colour[c] += from.colour[c] / 8;
        }
        setDirection(v, Vec3f(principalDirection(tensor).stored()));
        append(s, float(moment[0] / v.density), float(moment[1] / v.density),
               float(moment[2] / v.density), v);
        i = end;
    }
    setBounds(s);
    return s;
}

} // namespace volcomp
