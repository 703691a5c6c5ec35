// SPDX-License-Identifier: Apache-2.0
#include "volcomp/compose/virtual_composite.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <condition_variable>
#include <mutex>
#include <unordered_map>
#include <utility>

#include <fmt/format.h>
#include <tbb/enumerable_thread_specific.h>

#include "volcomp/base/error.h"
#include "volcomp/base/node_index.h"
#include "volcomp/compose/compose_input.h"
#include "volcomp/compose/node_sources.h"

namespace volcomp {
namespace {

using openvdb::Coord;

constexpr double kFarthestVoxel = double(1 << 27); ///< from the origin: what tables of nodes hold

/// What a thread makes tiles with.
struct Worker {
    TileAccumulator sums;
    VoxelStore store;
    std::vector<PackedBlock> blocks; ///< of one tile
};
constexpr std::size_t kWorkerBytes = std::size_t(5) << 19; ///< about, most of it the sums

/// What all levels share.
struct Shared {
    Shared(BoxSources boxes, const PlacedScene& scene)
        : packed(std::move(boxes)), skins(skinsOf(scene)), tree(packed, scene, skins)
    {
        materials.reserve(packed.materials.size());
        for (const std::string& name : packed.materials)
            materials.emplace_back(packed, scene, name);
    }
    Worker& worker()
    {
        bool there = false;
        Worker& local = workers.local(there);
        if (!there) ++worker_count;
        return local;
    }

    BoxSources packed;
    std::vector<Skin> skins;
    SourceTree tree;
    std::vector<MaterialSources> materials;
    tbb::enumerable_thread_specific<Worker> workers;
    std::atomic<std::size_t> worker_count{0};
};

/// The sources of nodes that were asked for. For several threads at once, but for clear().
class NodeCache {
public:
    /// The sources of a node, which `find` finds if they are not kept; null if there are none.
    /// Of several threads that ask for one node at once, one finds them and the others wait, as a
    /// node may have millions. `find` must not wait for other threads.
    template <class Find>
    const NodeSources* get(const Coord& node, const Find& find)
    {
        const std::uint64_t key = keyOf(node);
        Shard& shard = m_shards[key * 0x9e3779b97f4a7c15ULL >> 58];
        std::unique_lock lock(shard.mutex);
        for (;;) {
            if (const auto found = shard.nodes.find(key); found != shard.nodes.end())
                return found->second.get();
            // Who waited for a node without sources looks it up again: that is quick.
            if (std::find(shard.busy.begin(), shard.busy.end(), key) == shard.busy.end()) break;
            shard.done.wait(lock);
        }
        shard.busy.push_back(key);
        lock.unlock();
        const BusyNode busy(shard, key);
        auto sources = std::make_unique<const NodeSources>(find());
        if (sources->empty()) return nullptr;
        const NodeSources* const kept = sources.get();
        const std::size_t bytes = sources->memoryBytes() + kEntryBytes;
        {
            const std::lock_guard again(shard.mutex);
            shard.nodes.emplace(key, std::move(sources));
        }
        m_bytes += bytes;
        return kept;
    }
    void clear()
    {
        for (Shard& shard : m_shards) {
            std::unordered_map<std::uint64_t, std::unique_ptr<const NodeSources>>().swap(
                shard.nodes);
        }
        m_bytes = 0;
    }
    std::size_t memoryBytes() const { return sizeof(*this) + m_bytes; }

private:
    static std::uint64_t keyOf(const Coord& node)
    {
        std::uint64_t key = 0;
        for (int i = 0; i < 3; ++i)
            key = key << 21 | (std::uint64_t(std::int64_t(node[i]) / kNodeDim) & 0x1fffff);
        return key;
    }
    static constexpr std::size_t kEntryBytes = 48; ///< of the table, for each node, about

    struct Shard {
        std::mutex mutex;
        std::condition_variable done; ///< of a node that was in `busy`
        std::unordered_map<std::uint64_t, std::unique_ptr<const NodeSources>> nodes;
        std::vector<std::uint64_t> busy; ///< nodes whose sources a thread is finding
    };
    /// Takes a node out of the busy ones, also if finding its sources has failed.
    class BusyNode {
    public:
        BusyNode(Shard& shard, std::uint64_t key) : m_shard(shard), m_key(key) { }
        ~BusyNode()
        {
            const std::lock_guard lock(m_shard.mutex);
            std::vector<std::uint64_t>& busy = m_shard.busy;
            busy.erase(std::find(busy.begin(), busy.end(), m_key));
            m_shard.done.notify_all();
        }
        BusyNode(const BusyNode&) = delete;
        BusyNode& operator=(const BusyNode&) = delete;

    private:
        Shard& m_shard;
        std::uint64_t m_key;
    };
    std::array<Shard, 64> m_shards;
    std::atomic<std::size_t> m_bytes{0};
};

std::vector<TargetSources> sourcesAt(const Shared& shared, const BlockedTable& blocked,
                                     const ComposeParams& params)
{
    std::vector<TargetSources> sources;
    sources.reserve(shared.materials.size());
    for (const MaterialSources& material : shared.materials)
        sources.emplace_back(material, blocked, params);
    return sources;
}

/// Without any material there is one empty part, as compose() has it.
std::vector<PackedPart> emptyParts(const std::vector<TargetSources>& sources)
{
    std::vector<PackedPart> parts;
    parts.reserve(sources.size() + 1);
    for (const TargetSources& s : sources) parts.push_back(s.emptyPart());
    if (parts.empty()) parts.emplace_back();
    return parts;
}

std::vector<PartInfo> infosOf(const std::vector<PackedPart>& parts)
{
    std::vector<PartInfo> infos;
    infos.reserve(parts.size());
    for (const PackedPart& part : parts) infos.push_back(infoOf(part));
    return infos;
}

/// Whole leaves around bounds in the world.
openvdb::CoordBBox leavesAround(const openvdb::BBoxd& bounds, double voxel)
{
    if (bounds.min()[0] > bounds.max()[0]) return {};
    Coord low, high;
    for (int i = 0; i < 3; ++i) {
        low[i] = static_cast<int>(std::floor(bounds.min()[i] / voxel + 0.5)) & ~(kLeafDim - 1);
        high[i] = static_cast<int>(std::floor(bounds.max()[i] / voxel + 0.5)) | (kLeafDim - 1);
    }
    return {low, high};
}

/// What is fixed of a level before its TileMaker is made.
struct LevelSources {
    LevelSources(const Shared& shared, const ComposeParams& params)
        : blocked(findBlocked(shared.packed, params.voxel, params.keep)),
          materials(sourcesAt(shared, blocked, params)), parts(emptyParts(materials))
    {
    }
    BlockedTable blocked;
    std::vector<TargetSources> materials;
    std::vector<PackedPart> parts; ///< without voxels
};

class CompositeLevel : public TileMaker {
public:
    CompositeLevel(Shared& shared, const ComposeParams& params,
                   std::unique_ptr<const LevelSources> sources)
        : TileMaker(infosOf(sources->parts),
                    openvdb::math::Transform::createLinearTransform(params.voxel),
                    leavesAround(shared.tree.bounds(params.voxel), params.voxel)),
          m_shared(shared), m_voxel(params.voxel), m_sources(std::move(sources))
    {
    }

    double voxel() const { return m_voxel; }

    std::bitset<kTilesOfNode> tiles(const Coord& node) const override
    {
        const NodeSources* sources = sourcesOf(node);
        return sources ? sources->tiles() : std::bitset<kTilesOfNode>();
    }

    void make(const Coord& tile, TileVoxels& voxels) const override
    {
        for (BlockVoxels& block : voxels) {
            block.resize(parts().size());
            for (PartVoxels& part : block) part.clear();
        }
        const NodeSources* sources = sourcesOf(tile & ~(kNodeDim - 1));
        if (!sources) return;
        Worker& worker = m_shared.worker();
        const int number = tileInNode(tile[0], tile[1], tile[2]);
        for (std::size_t p = 0; p < m_sources->materials.size(); ++p) {
            const NodeSources::List list = sources->list(p, number);
            if (list.count == 0) continue;
            worker.store.reuse();
            worker.blocks.clear();
            m_sources->materials[p].compose(
                tile, list.count, [&](std::size_t k) { return list.first[k]; }, worker.sums,
                worker.store, worker.blocks);
            for (const PackedBlock& block : worker.blocks)
                takeBlock(m_sources->parts[p], block, voxels[leafInTile(block.origin)][p]);
        }
    }

    void forget() override { m_nodes.clear(); }
    std::size_t memoryBytes() const override { return m_nodes.memoryBytes(); }

private:
    static std::size_t leafInTile(const Coord& leaf)
    {
        return static_cast<std::size_t>((leaf[0] >> 3 & 1) << 2 | (leaf[1] >> 3 & 1) << 1
                                        | (leaf[2] >> 3 & 1));
    }
    const NodeSources* sourcesOf(const Coord& node) const
    {
        return m_nodes.get(
            node, [&] { return NodeSources(m_shared.tree, m_sources->materials, m_voxel, node); });
    }

    Shared& m_shared;
    double m_voxel;
    std::unique_ptr<const LevelSources> m_sources;
    mutable NodeCache m_nodes;
};

void checkReach(const openvdb::BBoxd& bounds, double voxel)
{
    double far = 0;
    for (int i = 0; i < 3; ++i)
        if (bounds.min()[0] <= bounds.max()[0])
            far = std::max({far, std::abs(bounds.min()[i]), std::abs(bounds.max()[i])});
    if (far < voxel * kFarthestVoxel) return;
    throw Error(fmt::format("compose: voxel: expected at least {:.3g} m for a scene that reaches "
                            "{:.4g} m from its origin (2^27 voxels), found {:g} m",
                            1.01 * far / kFarthestVoxel, far, voxel));
}

} // namespace

struct VirtualComposite::Impl {
    template <class Boxes> // of Box or PackedBox
    Impl(Boxes&& boxes, const PlacedScene& scene, const ComposeParams& params, double finest,
         int count, const Progress& progress)
        : shared(packBoxes(std::forward<Boxes>(boxes), scene, std::ldexp(finest, count - 1),
                           params.keep),
                 scene)
    {
        checkReach(shared.tree.bounds(finest), finest);
        for (int n = 0; n < count; ++n) {
            ComposeParams at_level = params;
            at_level.voxel = std::ldexp(finest, n);
            levels.push_back(std::make_unique<CompositeLevel>(
                shared, at_level, std::make_unique<const LevelSources>(shared, at_level)));
            report(progress, double(n + 1) / double(count));
        }
        dropFiner(shared.packed, finest);
    }
    Shared shared;
    std::vector<std::unique_ptr<CompositeLevel>> levels;
};

namespace {

ComposeParams checked(std::size_t boxes, const PlacedScene& scene, const ComposeParams& params,
                      double finest, int levels)
{
    ComposeParams at_finest = params;
    at_finest.voxel = finest;
    checkComposeInput(boxes, scene, at_finest);
    if (levels < 1 || !std::isfinite(std::ldexp(finest, levels - 1)))
        throw Error(fmt::format("compose: expected 1 level or more, found {}", levels));
    return at_finest;
}

} // namespace

VirtualComposite::VirtualComposite(const std::vector<Box>& boxes, const PlacedScene& scene,
                                   const ComposeParams& params, double finest, int levels,
                                   const Progress& progress)
    : m_impl(std::make_unique<Impl>(boxes, scene,
                                    checked(boxes.size(), scene, params, finest, levels), finest,
                                    levels, progress))
{
}

VirtualComposite::VirtualComposite(std::vector<PackedBox>&& boxes, const PlacedScene& scene,
                                   const ComposeParams& params, double finest, int levels,
                                   const Progress& progress)
{
    const ComposeParams at_finest = checked(boxes.size(), scene, params, finest, levels);
    m_impl = std::make_unique<Impl>(std::move(boxes), scene, at_finest, finest, levels, progress);
}

VirtualComposite::~VirtualComposite() = default;
VirtualComposite::VirtualComposite(VirtualComposite&&) noexcept = default;
VirtualComposite& VirtualComposite::operator=(VirtualComposite&&) noexcept = default;

int VirtualComposite::levels() const { return static_cast<int>(m_impl->levels.size()); }

double VirtualComposite::voxel(int level) const
{
    return m_impl->levels.at(static_cast<std::size_t>(level))->voxel();
}

TileMaker& VirtualComposite::level(int level)
{
    return *m_impl->levels.at(static_cast<std::size_t>(level));
}

const TileMaker& VirtualComposite::level(int level) const
{
    return *m_impl->levels.at(static_cast<std::size_t>(level));
}

std::size_t VirtualComposite::memoryBytes() const
{
    return m_impl->shared.packed.bytes() + m_impl->shared.tree.memoryBytes()
        + m_impl->shared.worker_count * kWorkerBytes;
}

} // namespace volcomp
