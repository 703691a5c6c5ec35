// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/tree/tree_leaf.h"

#include <algorithm>
#include <cmath>
#include <string>

#include <fmt/format.h>

namespace volcomp {
namespace {

// The brightest of the finite components.
float brightest(const Vec3f& c)
{
    float most = 0;
    for (int i = 0; i < 3; ++i)
        if (std::isfinite(c[i])) most = std::max(most, c[i]);
    return most;
}

} // namespace

Error badDensity(const PartInfo& part, const openvdb::Coord& leaf, int voxel, float density)
{
    return Error(fmt::format(
        "grid '{}', voxel ({}, {}, {}): expected a finite density >= 0, found {:g}", part.grid,
        leaf.x() + (voxel >> 6), leaf.y() + (voxel >> 3 & 7), leaf.z() + (voxel & 7), density));
}

LeafFiller::Counts LeafFiller::sumDensities(const BlockVoxels& voxels, const openvdb::Coord& origin,
                                            TreeLeaf& leaf, Sums& sums) const
{
    Counts count{};
    sums.fill(0);
    leaf.colour_scale = 0;
    for (std::size_t p = 0; p < voxels.size(); ++p) {
        const PartVoxels& part = voxels[p];
        forEachVoxelOf(part.mask, [&](int n, std::size_t k) {
            const float own = PartVoxels::at(part.density, k, 0.0f);
            sums[n] += own;
            for (const float value : {own, sums[n]})
                if (!(value >= 0) || !std::isfinite(value))
                    throw badDensity(m_parts[p], origin, n, value);
            ++count[n];
        });
        for (const Vec3f& colour : part.colour)
            leaf.colour_scale = std::max(leaf.colour_scale, brightest(colour));
    }
    for (int n = 0; n < kLeafSize; ++n)
        if (sums[n] > 0) leaf.mask[n >> 6] |= std::uint64_t(1) << (n & 63);
    leaf.countBefore();
    return count;
}

std::uint32_t LeafFiller::listEntries(const TreeLeaf& leaf, const Counts& count) const
{
    std::uint32_t entries = 0;
    for (int n = 0; n < (leaf.uniform ? 1 : kLeafSize); ++n)
        if (needsList(count[n])) entries += count[n];
    return entries;
}

void LeafFiller::writeRecords(const BlockVoxels& voxels, const Counts& count, const Sums& sums,
                              const LeafToFill& to, std::uint32_t first_entry) const
{
    TreeLeaf& l = to.leaf;
    if (l.uniform) to.density[l.first] = sums[0];
    else forEachVoxelOf(l.mask, [&](int n, std::size_t k) { to.density[l.first + k] = sums[n]; });
    std::array<std::uint32_t, kLeafSize> cursor{};
    std::uint32_t next = first_entry;
    for (int n = 0; n < (l.uniform ? 1 : kLeafSize); ++n) {
        if (!needsList(count[n])) continue;
        cursor[n] = next;
        to.records[l.recordIndex(n)] = VoxelRecord::list(next, count[n]);
        next += count[n];
    }
    for (std::size_t p = 0; p < voxels.size(); ++p) {
        const PartVoxels& part = voxels[p];
        forEachVoxelOf(part.mask, [&](int n, std::size_t k) {
            if (l.uniform && n > 0) return;
            const VoxelRecord record(PartVoxels::at(part.direction, k, Vec3f(0.0f)),
                                     PartVoxels::at(part.colour, k, Vec3f(1.0f)), l.colour_scale,
                                     int(p), PartVoxels::at(part.own_share, k, 0.0f));
            l.directed |= record.directed();
            const std::uint32_t at = l.recordIndex(n);
            const float density = PartVoxels::at(part.density, k, 0.0f);
            if (needsList(count[n])) to.listed[cursor[n]++] = {record, density, std::int32_t(p)};
            else to.records[at] = record;
            if (part.scatter_ratio.empty()) return;
            const Vec3f& s = PartVoxels::at(part.scatter_ratio, k, Vec3f(1.0f));
            // The mean over the parts, weighed by their density; 1 where a part has none.
            const float w = density / sums[n];
            for (std::size_t i = 0; i < 3; ++i) to.scatter_ratio[at][i] += w * (s[int(i)] - 1);
        });
    }
}

} // namespace volcomp
