// SPDX-License-Identifier: Apache-2.0
#include "volcomp/compose/node_sources.h"

#include <algorithm>
#include <limits>

#include "volcomp/base/error.h"

namespace volcomp {
namespace {

using Tiles = std::bitset<kTilesOfNode>;

/// Collects pairs of a list and a source as numbers that sort by list, then by source.
class PairCollector {
public:
    explicit PairCollector(const openvdb::Coord& node) : m_tiles(tilesOf(node)) { }

    void add(const TargetSources& sources, std::size_t material, std::uint32_t placement)
    {
        const std::size_t before = m_pairs.size();
        sources.forTilesOf(placement, &m_tiles,
                           [&](const openvdb::Coord& t) { append(material, t, placement); });
        if (m_pairs.size() - before <= kFewTiles)
            for (std::size_t i = before; i < m_pairs.size(); ++i) m_reached.set(tileOf(m_pairs[i]));
        else
            sources.forGroupsOf(
                placement, m_tiles,
                [&](const openvdb::CoordBBox& tiles, bool last) { return !reach(tiles, last); });
    }
    void add(const TargetSources& sources, std::size_t material, std::uint32_t source,
             const Skin& skin, std::size_t triangle)
    {
        sources.forTilesOf(skin, static_cast<std::int32_t>(triangle), &m_tiles,
                           [&](const openvdb::Coord& t) {
                               append(material, t, source);
                               m_reached.set(numberOf(t));
                           });
    }
    /// Those of the tiles that anything reaches. Their lists are whole: a box that misses the tile
    /// with its voxels, but not with its bounds, counts for the weights of ties.
    std::vector<std::uint64_t> sorted()
    {
        m_pairs.erase(std::remove_if(m_pairs.begin(), m_pairs.end(),
                                     [&](std::uint64_t pair) { return !m_reached[tileOf(pair)]; }),
                      m_pairs.end());
        std::sort(m_pairs.begin(), m_pairs.end());
        return std::move(m_pairs);
    }

private:
    /// Beyond so many tiles of a placement it is worth while to look which ones its voxels reach.
    static constexpr std::size_t kFewTiles = 8;

    static openvdb::CoordBBox tilesOf(const openvdb::Coord& node)
    {
        const openvdb::Coord first(node[0] >> 4, node[1] >> 4, node[2] >> 4);
        static_assert(kTileDim == TileAccumulator::kSize && kTileDim == 1 << 4);
        return {first, first.offsetBy(kNodeDim / kTileDim - 1)};
    }
    static std::size_t numberOf(const openvdb::Coord& t)
    {
        return static_cast<std::size_t>(
            tileInNode(t[0] * kTileDim, t[1] * kTileDim, t[2] * kTileDim));
    }
    static std::size_t tileOf(std::uint64_t pair) { return pair >> 32 & (kTilesOfNode - 1); }

    void append(std::size_t material, const openvdb::Coord& t, std::uint32_t source)
    {
        m_pairs.push_back(std::uint64_t(material * kTilesOfNode + numberOf(t)) << 32 | source);
    }
    /// Marks tiles that a group of voxels reaches. Returns false if smaller groups are to be looked
    /// at instead.
    bool reach(const openvdb::CoordBBox& tiles, bool last)
    {
        Tiles all;
        for (auto t = tiles.begin(); t != tiles.end(); ++t) all.set(numberOf(*t));
        if ((all & ~m_reached).none()) return true;
        if (!last && all.count() > 1) return false;
        m_reached |= all;
        return true;
    }

    openvdb::CoordBBox m_tiles;
    std::vector<std::uint64_t> m_pairs;
    Tiles m_reached; ///< by anything that is added
};

/// The node in the world, grown on all sides.
openvdb::BBoxd boundsOf(const openvdb::Coord& node, double voxel, double grown)
{
    const Vec3d low = node.asVec3d() - Vec3d(0.5 + grown);
    return {low * voxel, (low + Vec3d(kNodeDim + 2 * grown)) * voxel};
}

} // namespace

NodeSources::NodeSources(const SourceTree& tree, const std::vector<TargetSources>& materials,
                         double voxel, const openvdb::Coord& node)
{
    PairCollector pairs(node);
    tree.forPlacements(boundsOf(node, voxel, SourceTree::kSpread), [&](std::uint32_t placement) {
        for (std::size_t m = 0; m < materials.size(); ++m) pairs.add(materials[m], m, placement);
    });
    if (!materials.empty()) {
        const MaterialSources& any = materials[0].material();
        const auto first_triangle = static_cast<std::uint32_t>(any.scene().boxes.size());
        tree.forTriangles(boundsOf(node, voxel, tree.skinSpread()), [&](std::uint32_t triangle) {
            std::size_t in_skin = triangle;
            auto skin = any.skins().begin();
            for (; in_skin >= skin->surface().mesh().triangles.size(); ++skin)
                in_skin -= skin->surface().mesh().triangles.size();
            for (std::size_t m = 0; m < materials.size(); ++m)
                if (materials[m].material().material() == skin->material())
                    pairs.add(materials[m], m, first_triangle + triangle, *skin, in_skin);
        });
    }
    setLists(pairs.sorted());
}

void NodeSources::setLists(const std::vector<std::uint64_t>& sorted)
{
    if (sorted.size() > std::numeric_limits<std::uint32_t>::max())
        throw Error("compose: expected fewer than 2^32 boxes in a part of 128^3 voxels; use a "
                    "finer voxel");
    const auto keyOf = [](std::uint64_t pair) { return static_cast<std::uint32_t>(pair >> 32); };
    std::size_t runs = 0;
    for (std::size_t i = 0; i < sorted.size(); ++i)
        runs += i == 0 || keyOf(sorted[i]) != keyOf(sorted[i - 1]);
    m_runs.reserve(runs);
    m_sources.reserve(sorted.size());
    for (const std::uint64_t pair : sorted) {
        if (m_runs.empty() || m_runs.back().key != keyOf(pair))
            m_runs.push_back({keyOf(pair), static_cast<std::uint32_t>(m_sources.size())});
        m_sources.push_back(static_cast<std::uint32_t>(pair));
    }
}

std::bitset<kTilesOfNode> NodeSources::tiles() const
{
    std::bitset<kTilesOfNode> tiles;
    for (const Run& run : m_runs) tiles.set(run.key % kTilesOfNode);
    return tiles;
}

NodeSources::List NodeSources::list(std::size_t material, int tile) const
{
    const auto key =
        static_cast<std::uint32_t>(material * kTilesOfNode) + static_cast<std::uint32_t>(tile);
    const auto run = std::lower_bound(m_runs.begin(), m_runs.end(), key,
                                      [](const Run& r, std::uint32_t k) { return r.key < k; });
    if (run == m_runs.end() || run->key != key) return {nullptr, 0};
    const std::size_t end = run + 1 == m_runs.end() ? m_sources.size() : (run + 1)->first;
    return {&m_sources[run->first], end - run->first};
}

std::size_t NodeSources::memoryBytes() const
{
    return sizeof(*this) + m_runs.capacity() * sizeof(Run)
        + m_sources.capacity() * sizeof(std::uint32_t);
}

} // namespace volcomp
