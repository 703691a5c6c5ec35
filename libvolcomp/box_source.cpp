#include "box_source.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <tuple>

#include "eigen3.h"
#include "error.h"

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

/// Ends the block that holds the voxels from `begin` on, and widens the part's bounds.
void closeBlock(SourcePart& s, std::uint32_t begin)
{
    const auto end = static_cast<std::uint32_t>(s.voxels.size());
    if (begin == end) return;
    Vec3f low(std::numeric_limits<float>::max()), high(-std::numeric_limits<float>::max());
    for (std::uint32_t k = begin; k < end; ++k) {
        const Vec3f p(s.x[k], s.y[k], s.z[k]);
        low = openvdb::math::minComponent(low, p);
        high = openvdb::math::maxComponent(high, p);
    }
    s.blocks.push_back({{(low + high) * 0.5f, (high - low) * 0.5f + Vec3f(0.5f)}, begin, end});
}

SourceBounds united(const SourceBounds& a, const SourceBounds& b)
{
    const Vec3f low = openvdb::math::minComponent(a.centre - a.half, b.centre - b.half),
                high = openvdb::math::maxComponent(a.centre + a.half, b.centre + b.half);
    return {(low + high) * 0.5f, (high - low) * 0.5f};
}

/// The coordinates of a block, bit by bit in turn: sorted by it, neighbours stay together (Morton 1966).
std::uint64_t mortonKey(const SourceBlock& b)
{
    std::uint64_t key = 0;
    for (int bit = 20; bit >= 0; --bit)
        for (int i = 0; i < 3; ++i)
            key = key << 1 | ((static_cast<std::int64_t>(std::floor(b.bounds.centre[i] / 8)) + (1 << 20)) >> bit & 1);
    return key;
}

/// Sorts the blocks and finds the bounds of their groups and of all.
void setBounds(SourcePart& s)
{
    if (s.blocks.empty()) return;
    std::vector<std::pair<std::uint64_t, SourceBlock>> sorted;
    for (const SourceBlock& b : s.blocks) sorted.emplace_back(mortonKey(b), b);
    std::stable_sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    std::vector<SourceBounds> members;
    for (std::size_t i = 0; i < sorted.size(); ++i) {
        s.blocks[i] = sorted[i].second;
        members.push_back(s.blocks[i].bounds);
    }
    s.groups.clear();
    while (members.size() > 1) {
        std::vector<SourceBounds> group;
        for (std::size_t i = 0; i < members.size(); ++i)
            if (i % 8 == 0) group.push_back(members[i]);
            else group.back() = united(group.back(), members[i]);
        s.groups.push_back(group);
        members = std::move(group);
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
    if (!(s.voxel > 0) || (one - openvdb::Vec3d(s.voxel)).length() > 1e-6 * s.voxel || origin.length() > 1e-6 * s.voxel)
        throw Error(place + "expected cubic voxels whose (0,0,0) lies at the origin, found another transform");

    openvdb::FloatGrid::ConstPtr density = part.density;
    if (density->tree().hasActiveTiles()) {
        const auto copy = density->deepCopy();
        copy->tree().voxelizeActiveTiles();
        density = copy;
    }
    std::optional<openvdb::Vec3SGrid::ConstAccessor> direction, colour;
    if (part.direction) direction.emplace(part.direction->getConstAccessor());
    if (part.colour) colour.emplace(part.colour->getConstAccessor());
    for (auto leaf = density->tree().cbeginLeaf(); leaf; ++leaf) {
        const auto begin = static_cast<std::uint32_t>(s.voxels.size());
        for (auto it = leaf->cbeginValueOn(); it; ++it) {
            const float rho = *it;
            if (!std::isfinite(rho) || rho < 0) throw Error(place + "expected densities that are finite and not negative, found others");
            if (rho == 0) continue;
            const openvdb::Coord c = it.getCoord();
            SourceVoxel v;
            v.density = rho;
            setDirection(v, direction ? direction->getValue(c) : openvdb::Vec3s(0.0f));
            const openvdb::Vec3s rgb = colour ? colour->getValue(c) : s.colour;
            for (int i = 0; i < 3; ++i) {
                v.colour[i] = rho * rgb[i];
                if (!std::isfinite(v.colour[i] + v.v[i])) throw Error(place + "expected finite colours and directions, found others");
            }
            append(s, float(c[0]), float(c[1]), float(c[2]), v);
        }
        closeBlock(s, begin);
    }
    setBounds(s);
    return s;
}

SourcePart coarsen(const SourcePart& part)
{
    SourcePart s = part;
    s.voxel = 2 * part.voxel;
    s.blocks.clear();
    s.voxels.clear();
    s.x.clear(), s.y.clear(), s.z.clear();
    struct Cell {
        std::int32_t x, y, z;
        std::uint32_t voxel;
    };
    std::vector<Cell> cells;
    for (std::uint32_t k = 0; k < part.voxels.size(); ++k) {
        const auto half = [&](float x) { return static_cast<std::int32_t>(std::floor(double(x) / 2 + part.shift / 2)); };
        cells.push_back({half(part.x[k]), half(part.y[k]), half(part.z[k]), k});
    }
    const auto blockOf = [](const Cell& c) { return std::array<std::int32_t, 3>{c.x >> 3, c.y >> 3, c.z >> 3}; };
    const auto placeOf = [](const Cell& c) { return std::array<std::int32_t, 3>{c.x, c.y, c.z}; };
    std::sort(cells.begin(), cells.end(), [&](const Cell& a, const Cell& b) {
        return std::make_tuple(blockOf(a), placeOf(a), a.voxel) < std::make_tuple(blockOf(b), placeOf(b), b.voxel);
    });
    s.shift = part.shift / 2;
    std::uint32_t begin = 0;
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
        if (i > 0 && blockOf(cells[i]) != blockOf(cells[i - 1])) {
            closeBlock(s, begin);
            begin = static_cast<std::uint32_t>(s.voxels.size());
        }
        append(s, float(moment[0] / v.density), float(moment[1] / v.density), float(moment[2] / v.density), v);
        i = end;
    }
    closeBlock(s, begin);
    setBounds(s);
    return s;
}

} // namespace volcomp
