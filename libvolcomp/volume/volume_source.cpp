// SPDX-License-Identifier: Apache-2.0
// The blocks of OpenVDB grids.
#include <algorithm>
#include <cmath>

#include "volcomp/base/error.h"
#include "volcomp/volume/block_source.h"

namespace volcomp {
namespace {

using openvdb::Coord;
using FloatTree = openvdb::FloatTree;
using FloatNode = FloatTree::RootNodeType::ChildNodeType::ChildNodeType;
using FloatLeaf = FloatTree::LeafNodeType;
static_assert(FloatNode::DIM == kNodeDim && FloatLeaf::DIM == kLeafDim);

constexpr VoxelMask kAllVoxels = [] {
    VoxelMask mask{};
    for (std::uint64_t& word : mask) word = ~std::uint64_t(0);
    return mask;
}();

std::vector<PartInfo> partsOf(const Volume& volume)
{
    std::vector<PartInfo> parts;
    for (const VolumePart& part : volume.parts)
        parts.push_back({part.material, part.kind, part.density->getName(),
                         part.direction != nullptr, part.colour != nullptr,
                         part.scatter_ratio != nullptr, part.uniform_colour});
    return parts;
}

openvdb::math::Transform::ConstPtr transformOf(const Volume& volume)
{
    if (volume.parts.empty()) throw Error("the volume has no parts: there is nothing to render");
    return volume.parts[0].density->transformPtr();
}

// The density's value for all of a block without a leaf; 0 if it is inactive.
float tileOf(const VolumePart& part, const Coord& block)
{
    float tile = 0;
    return part.density->tree().probeValue(block, tile) ? tile : 0;
}

/// The values of a leaf, read from the file if they are still there. If that fails, OpenVDB 10.0
/// leaves a buffer behind that takes its values for a place in the file: its destructor would free
/// them as such. So that buffer, 2 to 6 KB, is never destroyed.
template <class Leaf>
const typename Leaf::ValueType* valuesOf(Leaf& leaf)
{
    using Buffer = typename Leaf::Buffer;
    try {
        return leaf.buffer().data();
    } catch (...) {
        const auto zero = openvdb::zeroVal<typename Leaf::ValueType>();
        leaf.swap(*new Buffer(openvdb::PartialCreate(), zero));
        throw;
    }
}

Vec3f finite(const Vec3f& v)
{
    return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]) ? v : Vec3f(0.0f);
}
float finite(float v) { return std::isfinite(v) ? v : 0; }

/// Whether a grid has the node (0) or the leaf (1) at a place.
template <int kWhich, class Grid>
bool hasNode(const std::shared_ptr<Grid>& grid, const Coord& at)
{
    using Tree = typename Grid::TreeType;
    using Node =
        std::conditional_t<kWhich == 0, typename Tree::RootNodeType::ChildNodeType::ChildNodeType,
                           typename Tree::LeafNodeType>;
    return grid && grid->tree().template probeConstNode<Node>(at);
}
/// The same for any of the grids beside the density.
template <int kWhich>
bool othersHaveNode(const VolumePart& part, const Coord& at)
{
    return hasNode<kWhich>(part.direction, at) || hasNode<kWhich>(part.colour, at)
        || hasNode<kWhich>(part.scatter_ratio, at) || hasNode<kWhich>(part.own_share, at);
}

// The values of the `count` voxels of a mask; one, if the grid has no leaf there. Reads them from
// the file, if they are still there.
template <class Grid>
void takeValues(const std::shared_ptr<Grid>& grid, const Coord& block, const VoxelMask& mask,
                std::size_t count, std::vector<typename Grid::ValueType>& to)
{
    if (!grid) return;
    auto* const leaf = grid->tree().probeLeaf(block);
    if (!leaf) {
        to.push_back(finite(grid->tree().getValue(block)));
        return;
    }
    const auto* values = valuesOf(*leaf);
    to.resize(count);
    auto* next = to.data();
    for (int x = 0; x < 8; ++x)
        for (std::uint64_t left = mask[x]; left; left &= left - 1)
            *next++ = finite(values[x << 6 | __builtin_ctzll(left)]);
}

void takePart(const VolumePart& part, const Coord& block, PartVoxels& to)
{
    to.clear();
    std::size_t count = kLeafSize;
    if (FloatLeaf* const leaf = part.density->tree().probeLeaf(block)) {
        const float* values = valuesOf(*leaf);
        to.density.reserve(kLeafSize);
        for (int x = 0; x < 8; ++x)
            for (std::uint64_t left = leaf->valueMask().getWord<std::uint64_t>(x); left;
                 left &= left - 1) {
                const float density = values[x << 6 | __builtin_ctzll(left)];
                if (density == 0) continue;
                to.mask[x] |= left & ~(left - 1);
                to.density.push_back(density);
            }
        count = to.density.size();
        if (count == 0) return;
    } else {
        const float tile = tileOf(part, block);
        if (tile == 0) return;
        to.mask = kAllVoxels;
        to.density.push_back(tile);
    }
    takeValues(part.direction, block, to.mask, count, to.direction);
    takeValues(part.scatter_ratio, block, to.mask, count, to.scatter_ratio);
    takeValues(part.own_share, block, to.mask, count, to.own_share);
    takeValues(part.colour, block, to.mask, count, to.colour);
    if (!part.colour) to.colour.push_back(part.uniform_colour);
}

// Frees the values of a tree's leaf; the leaf and its mask stay.
template <class Grid>
void freeLeaf(const std::shared_ptr<Grid>& grid, const Coord& block)
{
    using Leaf = typename Grid::TreeType::LeafNodeType;
    Leaf* leaf = grid ? grid->tree().probeLeaf(block) : nullptr;
    if (!leaf) return;
    typename Leaf::Buffer nothing(openvdb::PartialCreate(),
                                  openvdb::zeroVal<typename Leaf::ValueType>());
    leaf->swap(nothing);
}

} // namespace

void PartVoxels::clear()
{
    mask = {};
    density.clear();
    direction.clear();
    colour.clear();
    scatter_ratio.clear();
    own_share.clear();
}

VolumeSource::VolumeSource(Volume volume, TakenBlocks taken, std::string file)
    : BlockSource(partsOf(volume), transformOf(volume), volume.warnings, std::move(file)),
      m_volume(std::move(volume)), m_taken(taken)
{
    for (const VolumePart& part : m_volume.parts)
        for (const openvdb::GridBase::Ptr& grid :
             {openvdb::GridBase::Ptr(part.density), openvdb::GridBase::Ptr(part.direction),
              openvdb::GridBase::Ptr(part.colour), openvdb::GridBase::Ptr(part.scatter_ratio),
              openvdb::GridBase::Ptr(part.own_share)})
            if (grid && grid->transform() != transform())
                throw Error("the volume's grids have different transforms; resample them to one");
}

std::vector<Coord> VolumeSource::nodes() const
{
    constexpr int kRootDim = 4096; // voxels along an edge of the root's tiles
    constexpr int kMostTiles = 64; // each stands for 32^3 nodes
    int tiles = 0;
    std::vector<Coord> origins;
    for (const VolumePart& part : m_volume.parts) {
        const auto& root = part.density->tree().root();
        for (auto child = root.cbeginChildOn(); child; ++child) {
            for (auto node = child->cbeginChildOn(); node; ++node)
                origins.push_back(node->origin());
            for (auto tile = child->cbeginValueOn(); tile; ++tile)
                origins.push_back(tile.getCoord());
        }
        for (auto tile = root.cbeginValueOn(); tile; ++tile) {
            if (++tiles > kMostTiles)
                throw Error("the volume has more than " + std::to_string(kMostTiles)
                            + " solid cubes of 4096 voxels; use a larger voxel");
            for (int x = 0; x < kRootDim; x += kNodeDim)
                for (int y = 0; y < kRootDim; y += kNodeDim)
                    for (int z = 0; z < kRootDim; z += kNodeDim)
                        origins.push_back(tile.getCoord().offsetBy(x, y, z));
        }
    }
    std::sort(origins.begin(), origins.end());
    origins.erase(std::unique(origins.begin(), origins.end()), origins.end());
    return origins;
}

NodeBlocks VolumeSource::blocks(const Coord& origin) const
{
    NodeBlocks result;
    result.one_tile = true;
    for (const VolumePart& part : m_volume.parts) {
        const FloatNode* node = part.density->tree().probeConstNode<FloatNode>(origin);
        const bool others = othersHaveNode<0>(part, origin),
                   tile = !node && tileOf(part, origin) != 0;
        if (node || others) result.one_tile = false;
        if (tile) result.tiles.set();
        if (!node && !(tile && others)) continue;
        for (int n = 0; n < kNodeSize; ++n) {
            const Coord block = origin + leafInNode(n);
            const auto at = openvdb::Index(node ? FloatNode::coordToOffset(block) : 0);
            const bool leaf = node && node->isChildMaskOn(at),
                       active = node ? node->isValueMaskOn(at) : tile;
            if (leaf || (active && others && othersHaveNode<1>(part, block))) result.voxels.set(n);
            else if (active) result.tiles.set(n);
        }
    }
    result.tiles &= ~result.voxels;
    if (result.tiles.none()) result.one_tile = false;
    return result;
}

VoxelMask VolumeSource::mayHold(const Coord& block, std::size_t part) const
{
    VoxelMask mask{};
    if (const FloatLeaf* leaf = m_volume.parts[part].density->tree().probeConstLeaf(block))
        for (int x = 0; x < 8; ++x) mask[x] = leaf->valueMask().getWord<std::uint64_t>(x);
    else if (tileOf(m_volume.parts[part], block) != 0) mask = kAllVoxels;
    return mask;
}

void VolumeSource::take(const Coord& block, BlockVoxels& voxels) const
{
    voxels.resize(m_volume.parts.size());
    for (std::size_t p = 0; p < voxels.size(); ++p) takePart(m_volume.parts[p], block, voxels[p]);
    if (m_taken == TakenBlocks::stay) return;
    for (const VolumePart& part : m_volume.parts) {
        freeLeaf(part.density, block);
        freeLeaf(part.direction, block);
        freeLeaf(part.colour, block);
        freeLeaf(part.scatter_ratio, block);
        freeLeaf(part.own_share, block);
    }
}

} // namespace volcomp
