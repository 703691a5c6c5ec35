// SPDX-License-Identifier: Apache-2.0
#include "volcomp/volume/packed_volume.h"

#include <algorithm>
#include <cstdlib>
#include <new>
#include <optional>

#include <sys/mman.h>
#include <tbb/parallel_for.h>

namespace volcomp {
namespace {

using openvdb::math::half;

constexpr std::size_t kFirstChunk = std::size_t(1) << 16, kLargePage = std::size_t(1) << 21,
                      kLargestChunk = 2 * kLargePage;

Vec3f floats(const Half3& h) { return fromHalves(h); }
float floats(float v) { return v; }
float floats(half v) { return v; }

/// A grid of the values that `get` finds for a block: as many as the block has active voxels.
template <class Grid, class Get>
typename Grid::Ptr gridOf(const PackedPart& part, const openvdb::math::Transform& transform,
                          const Get& get)
{
    using Leaf = typename Grid::TreeType::LeafNodeType;
    std::vector<std::unique_ptr<Leaf>> leaves(part.blocks.size());
    tbb::parallel_for(std::size_t(0), leaves.size(), [&](std::size_t i) {
        const PackedBlock& block = part.blocks[i];
        leaves[i] = std::make_unique<Leaf>(block.origin, typename Grid::ValueType(0.0f));
        const auto* values = get(block);
        int k = 0;
        for (openvdb::Index x = 0; x < 8; ++x)
            for (std::uint64_t left = block.mask[x]; left; left &= left - 1)
                leaves[i]->setValueOn(x * 64 + openvdb::Index(__builtin_ctzll(left)),
                                      floats(values[k++]));
    });
    auto grid = Grid::create(typename Grid::ValueType(0.0f));
    grid->setTransform(transform.copy());
    grid->setGridClass(openvdb::GRID_FOG_VOLUME);
    auto accessor = grid->getAccessor();
    for (std::unique_ptr<Leaf>& leaf : leaves) accessor.addLeaf(leaf.release());
    return grid;
}

} // namespace

void VoxelStore::Free::operator()(std::byte* p) const { std::free(p); }

std::byte* VoxelStore::allocate(std::size_t bytes)
{
    bytes = (bytes + 7) & ~std::size_t(7);
    if (bytes > m_left) {
        const std::size_t wanted = std::max(bytes, std::clamp(m_bytes, kFirstChunk, kLargestChunk));
        const bool large = wanted >= kLargePage;
        const std::size_t page = large ? kLargePage : 4096,
                          size = (wanted + page - 1) / page * page;
        auto* chunk = static_cast<std::byte*>(std::aligned_alloc(page, size));
        if (!chunk) throw std::bad_alloc();
        m_chunks.emplace_back(chunk);
#ifdef MADV_HUGEPAGE
        if (large)
            ::madvise(chunk, size,
                      MADV_HUGEPAGE); // fewer page faults; without it all is the same, slower
#endif
        m_bytes += size;
        m_last = size;
        m_next = chunk;
        m_left = size;
    }
    std::byte* const result = m_next;
    m_next += bytes;
    m_left -= bytes;
    return result;
}

void VoxelStore::reuse()
{
    if (m_chunks.empty()) return;
    m_chunks.erase(m_chunks.begin(), m_chunks.end() - 1);
    m_next = m_chunks.back().get();
    m_left = m_bytes = m_last;
}

bool inTreeOrder(const openvdb::Coord& a, const openvdb::Coord& b)
{
    for (const int shift : {12, 7, 3})
        for (int i = 0; i < 3; ++i)
            if (a[i] >> shift != b[i] >> shift) return a[i] >> shift < b[i] >> shift;
    return false;
}

std::size_t PackedPart::voxels() const
{
    std::size_t n = 0;
    for (const PackedBlock& b : blocks) n += b.count;
    return n;
}

std::size_t PackedPart::bytes() const
{
    std::size_t n = blocks.capacity() * sizeof(PackedBlock);
    for (const VoxelStore& s : stores) n += s.bytes();
    return n;
}

std::size_t PackedVolume::voxels() const
{
    std::size_t n = 0;
    for (const PackedPart& p : parts) n += p.voxels();
    return n;
}

std::size_t PackedVolume::bytes() const
{
    std::size_t n = 0;
    for (const PackedPart& p : parts) n += p.bytes();
    return n;
}

namespace {

/// The active voxels of one part.
class Packer {
public:
    explicit Packer(const VolumePart& from) : m_density(from.density)
    {
        m_part.material = from.material;
        m_part.kind = from.kind;
        m_part.uniform_colour = from.uniform_colour;
        m_part.has_direction = from.direction != nullptr;
        m_part.has_colour = from.colour != nullptr;
        m_part.has_scatter_ratio = from.scatter_ratio != nullptr;
        m_part.has_own_share = from.own_share != nullptr;
        m_part.stores.emplace_back();
        m_density = withoutActiveTiles(m_density);
        if (from.direction) m_direction.emplace(from.direction->getConstAccessor());
        if (from.colour) m_colour.emplace(from.colour->getConstAccessor());
        if (from.scatter_ratio) m_scatter_ratio.emplace(from.scatter_ratio->getConstAccessor());
        if (from.own_share) m_own_share.emplace(from.own_share->getConstAccessor());
    }

    PackedPart run()
    {
        for (auto leaf = m_density->tree().cbeginLeaf(); leaf; ++leaf)
            if (leaf->onVoxelCount() > 0) add(*leaf);
        return std::move(m_part);
    }

private:
    using Vectors = std::optional<openvdb::Vec3SGrid::ConstAccessor>;

    void add(const openvdb::FloatTree::LeafNodeType& leaf)
    {
        PackedBlock block;
        block.origin = leaf.origin();
        block.count = static_cast<std::uint32_t>(leaf.onVoxelCount());
        for (openvdb::Index x = 0; x < 8; ++x)
            block.mask[x] = leaf.valueMask().template getWord<std::uint64_t>(x);
        block.values = m_part.stores[0].allocate(block.count * m_part.voxelBytes());
        float* density = m_part.density(block);
        for (auto v = leaf.cbeginValueOn(); v; ++v) *density++ = *v;
        addVectors(leaf, m_direction, m_part.direction(block));
        addVectors(leaf, m_colour, m_part.colour(block));
        addVectors(leaf, m_scatter_ratio, m_part.scatterRatio(block));
        if (half* to = m_part.ownShare(block))
            for (auto v = leaf.cbeginValueOn(); v; ++v)
                *to++ = half(m_own_share->getValue(v.getCoord()));
        m_part.blocks.push_back(block);
    }
    static void addVectors(const openvdb::FloatTree::LeafNodeType& leaf, Vectors& from, Half3* to)
    {
        if (!from) return;
        for (auto v = leaf.cbeginValueOn(); v; ++v) *to++ = toHalves(from->getValue(v.getCoord()));
    }

    PackedPart m_part;
    openvdb::FloatGrid::ConstPtr m_density;
    Vectors m_direction, m_colour, m_scatter_ratio;
    std::optional<openvdb::FloatGrid::ConstAccessor> m_own_share;
};

} // namespace

PackedVolume pack(const Volume& volume)
{
    PackedVolume packed;
    packed.transform = volume.parts.at(0).density->transform().copy();
    for (const VolumePart& part : volume.parts) packed.parts.push_back(Packer(part).run());
    return packed;
}

Volume unpack(const PackedVolume& packed)
{
    Volume volume;
    for (const PackedPart& from : packed.parts) {
        VolumePart& part = volume.parts.emplace_back();
        part.material = from.material;
        part.kind = from.kind;
        part.uniform_colour = from.uniform_colour;
        const auto vectors = [&](Half3* (PackedPart::*values)(const PackedBlock&) const) {
            return gridOf<openvdb::Vec3SGrid>(
                from, *packed.transform, [&](const PackedBlock& b) { return (from.*values)(b); });
        };
        part.density = gridOf<openvdb::FloatGrid>(
            from, *packed.transform, [&](const PackedBlock& b) { return from.density(b); });
        if (from.has_direction) part.direction = vectors(&PackedPart::direction);
        if (from.has_colour) part.colour = vectors(&PackedPart::colour);
        if (from.has_scatter_ratio) part.scatter_ratio = vectors(&PackedPart::scatterRatio);
        if (from.has_own_share)
            part.own_share = gridOf<openvdb::FloatGrid>(
                from, *packed.transform, [&](const PackedBlock& b) { return from.ownShare(b); });
    }
    return volume;
}

} // namespace volcomp
