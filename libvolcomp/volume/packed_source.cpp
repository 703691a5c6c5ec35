// SPDX-License-Identifier: Apache-2.0
// The blocks of a packed volume.
#include <algorithm>

#include "volcomp/base/error.h"
#include "volcomp/volume/block_source.h"
#include "volcomp/volume/packed_volume.h"

namespace volcomp {
namespace {

using openvdb::Coord;

std::vector<PartInfo> partsOf(const PackedVolume& volume)
{
    if (volume.parts.empty()) throw Error("the volume has no parts: there is nothing to render");
    std::vector<PartInfo> parts;
    parts.reserve(volume.parts.size());
    for (const PackedPart& part : volume.parts) parts.push_back(infoOf(part));
    return parts;
}

Coord nodeOf(const Coord& c) { return c & ~(kNodeDim - 1); }

// The part's first block that does not come before the one at `origin`.
std::vector<PackedBlock>::const_iterator lowerBound(const PackedPart& part, const Coord& origin)
{
    return std::lower_bound(
        part.blocks.begin(), part.blocks.end(), origin,
        [](const PackedBlock& b, const Coord& at) { return inTreeOrder(b.origin, at); });
}

const PackedBlock* find(const PackedPart& part, const Coord& origin)
{
    const auto block = lowerBound(part, origin);
    return block != part.blocks.end() && block->origin == origin ? &*block : nullptr;
}

// The values of the voxels whose density is not 0.
void takeValues(const Half3* from, const float* density, std::uint32_t count,
                std::vector<Vec3f>& to)
{
    if (!from) return;
    for (std::uint32_t i = 0; i < count; ++i)
        if (density[i] != 0) to.push_back(fromHalves(from[i]));
}
void takeValues(const openvdb::math::half* from, const float* density, std::uint32_t count,
                std::vector<float>& to)
{
    if (!from) return;
    for (std::uint32_t i = 0; i < count; ++i)
        if (density[i] != 0) to.push_back(from[i]);
}

} // namespace

PartInfo infoOf(const PackedPart& part)
{
    return {part.material,      part.kind,       "density of " + part.material,
            part.has_direction, part.has_colour, part.has_scatter_ratio,
            part.uniform_colour};
}

void takeBlock(const PackedPart& part, const PackedBlock& block, PartVoxels& to)
{
    const float* density = part.density(block);
    std::uint32_t i = 0;
    for (int x = 0; x < 8; ++x)
        for (std::uint64_t left = block.mask[x]; left; left &= left - 1, ++i) {
            if (density[i] == 0) continue;
            to.mask[x] |= left & ~(left - 1);
            to.density.push_back(density[i]);
        }
    if (to.density.empty()) return;
    takeValues(part.direction(block), density, block.count, to.direction);
    takeValues(part.colour(block), density, block.count, to.colour);
    takeValues(part.scatterRatio(block), density, block.count, to.scatter_ratio);
    takeValues(part.ownShare(block), density, block.count, to.own_share);
    if (!part.has_colour) to.colour.push_back(part.uniform_colour);
}

PackedSource::PackedSource(const PackedVolume& volume)
    : BlockSource(partsOf(volume), volume.transform), m_volume(volume)
{
}

std::vector<Coord> PackedSource::nodes() const
{
    std::vector<Coord> origins;
    for (const PackedPart& part : m_volume.parts)
        for (const PackedBlock& block : part.blocks)
            if (const Coord node = nodeOf(block.origin); origins.empty() || origins.back() != node)
                origins.push_back(node);
    std::sort(origins.begin(), origins.end());
    origins.erase(std::unique(origins.begin(), origins.end()), origins.end());
    return origins;
}

NodeBlocks PackedSource::blocks(const Coord& origin) const
{
    NodeBlocks result;
    for (const PackedPart& part : m_volume.parts)
        for (auto block = lowerBound(part, origin);
             block != part.blocks.end() && nodeOf(block->origin) == origin; ++block)
            result.voxels.set(numberInNode(block->origin[0], block->origin[1], block->origin[2]));
    return result;
}

VoxelMask PackedSource::mayHold(const Coord& block, std::size_t part) const
{
    const PackedBlock* found = find(m_volume.parts[part], block);
    return found ? found->mask : VoxelMask{};
}

void PackedSource::take(const Coord& block, BlockVoxels& voxels) const
{
    voxels.resize(m_volume.parts.size());
    for (std::size_t p = 0; p < voxels.size(); ++p) {
        voxels[p].clear();
        if (const PackedBlock* found = find(m_volume.parts[p], block))
            takeBlock(m_volume.parts[p], *found, voxels[p]);
    }
}

} // namespace volcomp
