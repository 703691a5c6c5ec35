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

openvdb::Vec3s floats(const Half3& h) { return {float(h[0]), float(h[1]), float(h[2])}; }
float floats(float v) { return v; }

/// A grid of the values that `get` finds for a block.
template <class Grid, class Get>
typename Grid::Ptr gridOf(const PackedPart& part, const openvdb::math::Transform& transform,
                          const Get& get)
{
    using Leaf = typename Grid::TreeType::LeafNodeType;
    std::vector<Leaf*> leaves(part.blocks.size());
    tbb::parallel_for(std::size_t(0), leaves.size(), [&](std::size_t i) {
        const PackedBlock& block = part.blocks[i];
        leaves[i] = new Leaf(block.origin, typename Grid::ValueType(0.0f));
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
    for (Leaf* leaf : leaves) accessor.addLeaf(leaf);
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
        m_next = chunk;
        m_left = size;
    }
    std::byte* const result = m_next;
    m_next += bytes;
    m_left -= bytes;
    return result;
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

PackedVolume pack(const Volume& volume)
{
    PackedVolume packed;
    packed.transform = volume.parts.at(0).density->transform().copy();
    for (const VolumePart& from : volume.parts) {
        PackedPart& part = packed.parts.emplace_back();
        part.material = from.material;
        part.kind = from.kind;
        part.uniform_colour = from.uniform_colour;
        part.has_direction = from.direction != nullptr;
        part.has_colour = from.colour != nullptr;
        part.stores.emplace_back();
        openvdb::FloatGrid::ConstPtr density = from.density;
        if (density->tree().hasActiveTiles()) {
            const auto copy = density->deepCopy();
            copy->tree().voxelizeActiveTiles();
            density = copy;
        }
        std::optional<openvdb::Vec3SGrid::ConstAccessor> direction, colour;
        if (from.direction) direction.emplace(from.direction->getConstAccessor());
        if (from.colour) colour.emplace(from.colour->getConstAccessor());
        const auto halves = [](const openvdb::Vec3s& v) {
            return Half3{half(v[0]), half(v[1]), half(v[2])};
        };
        for (auto leaf = density->tree().cbeginLeaf(); leaf; ++leaf) {
            PackedBlock block;
            block.origin = leaf->origin();
            block.count = static_cast<std::uint32_t>(leaf->onVoxelCount());
            if (block.count == 0) continue;
            for (openvdb::Index x = 0; x < 8; ++x)
                block.mask[x] = leaf->valueMask().template getWord<std::uint64_t>(x);
            block.values = part.stores[0].allocate(
                block.count * PackedPart::voxelBytes(part.has_direction, part.has_colour));
            float* d = part.density(block);
            Half3 *t = part.direction(block), *c = part.colour(block);
            for (auto it = leaf->cbeginValueOn(); it; ++it) {
                *d++ = *it;
                if (t) *t++ = halves(direction->getValue(it.getCoord()));
                if (c) *c++ = halves(colour->getValue(it.getCoord()));
            }
            part.blocks.push_back(block);
        }
    }
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
        part.density = gridOf<openvdb::FloatGrid>(
            from, *packed.transform, [&](const PackedBlock& b) { return from.density(b); });
        if (from.has_direction)
            part.direction = gridOf<openvdb::Vec3SGrid>(
                from, *packed.transform, [&](const PackedBlock& b) { return from.direction(b); });
        if (from.has_colour)
            part.colour = gridOf<openvdb::Vec3SGrid>(
                from, *packed.transform, [&](const PackedBlock& b) { return from.colour(b); });
    }
    return volume;
}

} // namespace volcomp
