// How a VoxelTree is made from grids.
#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <string>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "volcomp/base/error.h"
#include "volcomp/render/tree/voxel_tree.h"

namespace volcomp {
namespace {

using openvdb::Coord;
using FloatTree = openvdb::FloatTree;
using FloatBlock = FloatTree::RootNodeType::ChildNodeType::ChildNodeType;
using FloatLeaf = FloatTree::LeafNodeType;
using VectorLeaf = openvdb::Vec3STree::LeafNodeType;
using VectorBlock = openvdb::Vec3STree::RootNodeType::ChildNodeType::ChildNodeType;
static_assert(FloatBlock::DIM == kBlockDim && FloatLeaf::DIM == kLeafDim);

// Of its finite components.
float brightest(const Vec3f& c)
{
    float most = 0;
    for (int i = 0; i < 3; ++i)
        if (std::isfinite(c[i])) most = std::max(most, c[i]);
    return most;
}

} // namespace

// Fills the tables from the grids: first the places (blocks and leaves, in order) and how much each
// leaf may need, which the masks of active voxels say; then, in parallel, the voxels, so that each
// leaf of the grids is needed once and can be read from the file and freed on the way.
class VoxelTree::Builder {
public:
    Builder(VoxelTree& tree, const Volume& volume, bool empties)
        : m_tree(tree), m_parts(volume.parts), m_empties(empties)
    {
    }

    void run(const Progress& progress)
    {
        enumerateBlocks();
        m_tree.m_density.resize(m_sources.size() * 512);
        m_tree.m_leaves.resize(m_sources.size());
        std::uint64_t records = 0, lists = 0;
        std::vector<std::uint32_t> list(m_sources.size());
        for (std::size_t i = 0; i < m_sources.size(); ++i) {
            const auto [voxels, entries] = upperBounds(m_sources[i]);
            m_tree.m_leaves[i].first = std::uint32_t(records);
            list[i] = std::uint32_t(lists);
            records += voxels;
            lists += entries;
        }
        if (std::max(records, lists) >> 32)
            throw Error("the volume has more voxels than 2^32; use a larger voxel");
        m_tree.m_records.resize(records);
        m_tree.m_shared.resize(lists);
        if (std::any_of(m_parts.begin(), m_parts.end(),
                        [](const VolumePart& part) { return part.scatter_ratio != nullptr; }))
            m_tree.m_scatter_ratio.resize(records, {1, 1, 1});
        std::mutex mutex;
        std::size_t done = 0;
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, m_sources.size(), 64),
                          [&](const auto& range) {
                              for (std::size_t i = range.begin(); i < range.end(); ++i) {
                                  fillRecords(i, fillDensity(i), list[i]);
                                  if (m_empties) empty(m_sources[i].origin);
                              }
                              const std::lock_guard<std::mutex> lock(mutex);
                              done += range.size();
                              report(progress, double(done) / double(m_sources.size()));
                          });
        for (std::size_t i = 0; i < m_sources.size(); ++i) {
            const Leaf& l = m_tree.m_leaves[i];
            m_tree.m_voxels += (l.uniform ? 512ull : l.before[7] + __builtin_popcountll(l.mask[7]))
                * m_sources[i].uses;
            m_tree.m_directed_fibres |= l.directed_fibres;
        }
        for (const float density : m_tree.m_density)
            m_tree.m_max_density = std::max(m_tree.m_max_density, density);
    }

private:
    struct Source { // where a leaf's voxels come from
        Coord origin;
        bool uniform;
        std::uint64_t uses;
    };

    void enumerateBlocks()
    {
        std::vector<Coord> origins;
        for (const VolumePart& part : m_parts) {
            const auto& root = part.density->tree().root();
            for (auto node = root.cbeginChildOn(); node; ++node) {
                for (auto block = node->cbeginChildOn(); block; ++block)
                    origins.push_back(block->origin());
                for (auto tile = node->cbeginValueOn(); tile; ++tile)
                    origins.push_back(tile.getCoord());
            }
            for (auto tile = root.cbeginValueOn(); tile; ++tile)
                for (int x = 0; x < 4096; x += kBlockDim)
                    for (int y = 0; y < 4096; y += kBlockDim)
                        for (int z = 0; z < 4096; z += kBlockDim)
                            origins.push_back(tile.getCoord().offsetBy(x, y, z));
        }
        std::sort(origins.begin(), origins.end());
        origins.erase(std::unique(origins.begin(), origins.end()), origins.end());
        std::vector<int> blocks;
        blocks.reserve(origins.size());
        for (const Coord& origin : origins) blocks.push_back(makeBlock(origin));
        std::size_t size = 16;
        while (size < 2 * origins.size()) size *= 2;
        m_tree.m_slots.resize(size);
        m_tree.m_slot_mask = size - 1;
        for (std::size_t i = 0; i < origins.size(); ++i) {
            if (blocks[i] == kEmpty) continue;
            const Coord& o = origins[i];
            if (std::abs(std::int64_t(o[0])) >> 27 || std::abs(std::int64_t(o[1])) >> 27
                || std::abs(std::int64_t(o[2])) >> 27)
                throw Error(
                    "the volume reaches beyond 134 million voxels from its origin; move it or use a larger voxel");
            const std::uint64_t key = blockKey(o[0] >> 7, o[1] >> 7, o[2] >> 7);
            std::size_t slot = hash(key);
            while (m_tree.m_slots[slot & m_tree.m_slot_mask].block != kEmpty) ++slot;
            m_tree.m_slots[slot & m_tree.m_slot_mask] = {key, blocks[i]};
        }
    }

    // The block's number, after adding its leaves; kEmpty where it has none.
    int makeBlock(const Coord& origin)
    {
        std::vector<const FloatBlock*> nodes;
        std::vector<float> key; // of a block without nodes: it is the same wherever all values are
        bool any_node = false;
        for (const VolumePart& part : m_parts) {
            const FloatBlock* node = part.density->tree().probeConstNode<FloatBlock>(origin);
            any_node |= node
                || (part.direction && part.direction->tree().probeConstNode<VectorBlock>(origin))
                || (part.colour && part.colour->tree().probeConstNode<VectorBlock>(origin));
            nodes.push_back(node);
        }
        if (!any_node) {
            const int leaf = uniformLeaf(origin, 4096);
            if (leaf == kEmpty) return kEmpty;
            extend(origin, kBlockDim);
            const auto [at, fresh] =
                m_uniform_blocks.emplace(leaf, int(m_tree.m_children.size() / 4096));
            if (fresh) m_tree.m_children.resize(m_tree.m_children.size() + 4096, leaf);
            return at->second;
        }
        std::vector<std::int32_t> children(4096, kEmpty);
        bool any_leaf = false;
        for (int n = 0; n < 4096; ++n) {
            const Coord o = origin.offsetBy((n >> 8) * 8, (n >> 4 & 15) * 8, (n & 15) * 8);
            bool active = false, dense = false;
            for (std::size_t p = 0; p < m_parts.size(); ++p) {
                const VolumePart& part = m_parts[p];
                const bool has_leaf =
                    nodes[p] && nodes[p]->isChildMaskOn(FloatBlock::coordToOffset(o));
                const bool has_tile = nodes[p]
                    ? nodes[p]->isValueMaskOn(FloatBlock::coordToOffset(o))
                    : part.density->tree().isValueOn(o);
                active |= has_leaf || has_tile;
                dense |= has_leaf
                    || (has_tile
                        && ((part.direction && part.direction->tree().probeConstLeaf(o))
                            || (part.colour && part.colour->tree().probeConstLeaf(o))));
            }
            if (!active) continue;
            if (dense) {
                children[n] = std::int32_t(m_sources.size());
                m_sources.push_back({o, false, 1});
            } else children[n] = uniformLeaf(o, 1);
            if (children[n] != kEmpty) extend(o, kLeafDim);
            any_leaf |= children[n] != kEmpty;
        }
        if (!any_leaf) return kEmpty;
        m_tree.m_children.insert(m_tree.m_children.end(), children.begin(), children.end());
        return int(m_tree.m_children.size() / 4096) - 1;
    }

    // The leaf of an active tile; the same for all tiles that hold the same.
    int uniformLeaf(const Coord& o, std::uint64_t uses)
    {
        std::vector<float> key;
        bool active = false;
        for (const VolumePart& part : m_parts) {
            float density = 0;
            if (!part.density->tree().probeValue(o, density)) density = 0;
            active |= density != 0;
            key.push_back(density);
            for (const auto& grid : {part.direction, part.colour}) {
                const Vec3f v = grid ? grid->tree().getValue(o) : Vec3f(0.0f);
                key.insert(key.end(), {v[0], v[1], v[2]});
            }
        }
        if (!active) return kEmpty;
        const auto [at, fresh] = m_uniform_leaves.emplace(key, int(m_sources.size()));
        if (fresh) m_sources.push_back({o, true, 0});
        m_sources[at->second].uses += uses;
        return at->second;
    }

    void extend(const Coord& o, int dim)
    {
        m_tree.m_bounds.expand(openvdb::CoordBBox(o, o.offsetBy(dim - 1)));
    }

    // At most so many records and list entries, from what is active alone: the densities may still
    // be in the file.
    std::pair<std::uint64_t, std::uint64_t> upperBounds(const Source& source) const
    {
        const std::size_t parts = m_parts.size();
        if (source.uniform) return {1, parts > 1 ? parts : 0};
        std::array<std::uint64_t, 8> any{}, several{};
        std::vector<std::array<std::uint64_t, 8>> masks(parts);
        for (std::size_t p = 0; p < parts; ++p) {
            const FloatLeaf* leaf = m_parts[p].density->tree().probeConstLeaf(source.origin);
            float tile = 0;
            const bool full =
                !leaf && m_parts[p].density->tree().probeValue(source.origin, tile) && tile != 0;
            for (int w = 0; w < 8; ++w) {
                masks[p][w] = leaf ? leaf->valueMask().getWord<std::uint64_t>(w)
                    : full         ? ~std::uint64_t(0)
                                   : 0;
                several[w] |= any[w] & masks[p][w];
                any[w] |= masks[p][w];
            }
        }
        std::uint64_t records = 0, entries = 0;
        for (int w = 0; w < 8; ++w) {
            records += __builtin_popcountll(any[w]);
            for (const auto& mask : masks)
                entries +=
                    __builtin_popcountll(mask[w] & (parts > kMostParts ? any[w] : several[w]));
        }
        return {records, entries};
    }

    using Counts = std::array<std::uint8_t, 512>; // of parts in a voxel

    Counts fillDensity(std::size_t index)
    {
        Counts count{};
        const Source& source = m_sources[index];
        Leaf& l = m_tree.m_leaves[index];
        float* sum = &m_tree.m_density[index * 512];
        l.uniform = source.uniform;
        l.colour_scale = 0;
        for (const VolumePart& part : m_parts)
            forVoxels(part, source.origin,
                      [&](int n, float density, const Vec3f&, const Vec3f& colour) {
                          if (!(density >= 0) || !std::isfinite(density))
                              throw badDensity(part, source, n, density);
                          sum[n] += density;
                          if (!std::isfinite(sum[n])) throw badDensity(part, source, n, sum[n]);
                          ++count[n];
                          l.colour_scale = std::max(l.colour_scale, brightest(colour));
                      });
        for (int n = 0; n < 512; ++n)
            if (sum[n] > 0) l.mask[n >> 6] |= std::uint64_t(1) << (n & 63);
        for (int w = 1; w < 8; ++w)
            l.before[w] = std::uint16_t(l.before[w - 1] + __builtin_popcountll(l.mask[w - 1]));
        return count;
    }

    static Error badDensity(const VolumePart& part, const Source& source, int n, float density)
    {
        const Coord at = source.origin + FloatLeaf::offsetToLocalCoord(n);
        return Error("grid '" + part.density->getName() + "', voxel (" + std::to_string(at.x())
                     + ", " + std::to_string(at.y()) + ", " + std::to_string(at.z())
                     + "): expected a finite density >= 0, found " + std::to_string(density));
    }

    // A volume of more parts than a record can name keeps all of its voxels in lists.
    bool needsList(int parts_here) const
    {
        return parts_here > 1 || (m_parts.size() > kMostParts && parts_here > 0);
    }

    void fillRecords(std::size_t index, const Counts& count, std::uint32_t next)
    {
        Leaf& l = m_tree.m_leaves[index];
        std::array<std::uint32_t, 512> cursor{};
        for (int n = 0; n < (l.uniform ? 1 : 512); ++n) {
            if (!needsList(count[n])) continue;
            cursor[n] = next;
            m_tree.m_records[m_tree.recordIndex(l, n)] =
                kShared << 60 | std::uint64_t(count[n]) << 32 | next;
            next += count[n];
        }
        for (std::size_t p = 0; p < m_parts.size(); ++p)
            forVoxels(m_parts[p], m_sources[index].origin,
                      [&](int n, float density, const Vec3f& direction, const Vec3f& colour) {
                          if (l.uniform && n > 0) return;
                          const std::uint64_t record =
                              pack(direction, colour, l.colour_scale, int(p));
                          l.directed_fibres |=
                              m_tree.m_is_fibre[p] && int(record >> 24 & 63) != kSpreadCodes;
                          if (needsList(count[n]))
                              m_tree.m_shared[cursor[n]++] = {record, density, std::int32_t(p)};
                          else m_tree.m_records[m_tree.recordIndex(l, n)] = record;
                      });
        for (const VolumePart& part : m_parts) {
            if (!part.scatter_ratio) continue;
            const Coord& o = m_sources[index].origin;
            const VectorLeaf* leaf = part.scatter_ratio->tree().probeConstLeaf(o);
            const Vec3f* values = leaf ? leaf->buffer().data() : nullptr;
            const Vec3f everywhere = leaf ? Vec3f(1.0f) : part.scatter_ratio->tree().getValue(o);
            forVoxels(part, o, [&](int n, float, const Vec3f&, const Vec3f&) {
                const Vec3f& v = values ? values[n] : everywhere;
                m_tree.m_scatter_ratio[m_tree.recordIndex(l, n)] = {v[0], v[1], v[2]};
            });
        }
    }

    // Frees the leaf's values in all grids. Its topology stays.
    void empty(const Coord& o) const
    {
        const auto drop = [&](auto& tree) {
            using Leaf = typename std::decay_t<decltype(tree)>::LeafNodeType;
            Leaf* leaf = tree.probeLeaf(o);
            if (!leaf) return;
            typename Leaf::Buffer nothing(openvdb::PartialCreate(),
                                          openvdb::zeroVal<typename Leaf::ValueType>());
            leaf->swap(nothing);
        };
        for (const VolumePart& part : m_parts) {
            drop(part.density->tree());
            if (part.direction) drop(part.direction->tree());
            if (part.colour) drop(part.colour->tree());
            if (part.scatter_ratio) drop(part.scatter_ratio->tree());
        }
    }

    // f(offset, density, direction, colour) for the part's voxels of density other than 0 in the
    // leaf at `o`.
    template <class F>
    void forVoxels(const VolumePart& part, const Coord& o, const F& f) const
    {
        const auto& tree = part.density->tree();
        const FloatLeaf* leaf = tree.probeConstLeaf(o);
        float tile = 0;
        if (!leaf && (!tree.probeValue(o, tile) || tile == 0)) return;
        const auto valuesOf = [&](const openvdb::Vec3SGrid::Ptr& grid) -> const Vec3f* {
            const VectorLeaf* vectors = grid ? grid->tree().probeConstLeaf(o) : nullptr;
            return vectors ? vectors->buffer().data()
                           : nullptr; // read from the file here, if they still are there
        };
        const Vec3f *directions = valuesOf(part.direction), *colours = valuesOf(part.colour);
        const Vec3f direction =
            part.direction && !directions ? part.direction->tree().getValue(o) : Vec3f(0.0f);
        const Vec3f colour = !part.colour ? part.uniform_colour
            : !colours                    ? part.colour->tree().getValue(o)
                                          : Vec3f(0.0f);
        const float* densities = leaf ? leaf->buffer().data() : nullptr;
        for (int w = 0; w < 8; ++w)
            for (std::uint64_t mask = leaf ? leaf->valueMask().getWord<std::uint64_t>(w)
                                           : ~std::uint64_t(0);
                 mask; mask &= mask - 1) {
                const int n = w << 6 | __builtin_ctzll(mask);
                const float density = leaf ? densities[n] : tile;
                if (density != 0)
                    f(n, density, directions ? directions[n] : direction,
                      colours ? colours[n] : colour);
            }
    }

    VoxelTree& m_tree;
    const std::vector<VolumePart>& m_parts;
    const bool m_empties;
    std::vector<Source> m_sources;
    std::map<std::vector<float>, int> m_uniform_leaves;
    std::map<int, int> m_uniform_blocks;
};

VoxelTree::VoxelTree(const Volume& volume)
{
    readTransform(volume);
    Builder(*this, volume, false).run({});
}

VoxelTree::VoxelTree(Volume&& volume, const Progress& progress)
{
    readTransform(volume);
    Builder(*this, volume, true).run(progress);
    volume.parts.clear();
}

} // namespace volcomp
