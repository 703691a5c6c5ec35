// SPDX-License-Identifier: Apache-2.0
#include "volcomp/compose/compose.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>

#include <fmt/format.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include "volcomp/base/error.h"
#include "volcomp/base/node_index.h"
#include "volcomp/compose/compose_input.h"
#include "volcomp/compose/tile_sources.h"

namespace volcomp {
namespace {

constexpr double kFarthestVoxel = double(1 << 24); ///< from the origin, see forTilesBetween()

/// Blocks of one tile, at most eight.
struct TileBlocks {
    PackedBlock* first = nullptr;
    std::size_t count = 0;
};

/// The blocks of all tiles in the order of an OpenVDB tree. The tiles are in the order of its nodes
/// of 128^3 voxels, so that only the blocks of one node have to be sorted.
std::vector<PackedBlock> inTreeOrder(const TileSources& sources,
                                     const std::vector<TileBlocks>& tiles)
{
    std::vector<std::size_t> first_tile, first_block; // of each node
    std::size_t count = 0;
    for (std::size_t t = 0; t < tiles.size(); ++t) {
        if (t == 0 || sources.node(t) != sources.node(t - 1)) {
            first_tile.push_back(t);
            first_block.push_back(count);
        }
        count += tiles[t].count;
    }
    first_tile.push_back(tiles.size());
    std::vector<PackedBlock> blocks(count);
    tbb::parallel_for(std::size_t(0), first_block.size(), [&](std::size_t n) {
        const auto begin = blocks.begin() + static_cast<std::ptrdiff_t>(first_block[n]);
        auto to = begin;
        for (std::size_t t = first_tile[n]; t < first_tile[n + 1]; ++t)
            to = std::copy_n(tiles[t].first, tiles[t].count, to);
        std::sort(begin, to, [](const PackedBlock& a, const PackedBlock& b) {
            return numberInNode(a.origin) < numberInNode(b.origin);
        });
    });
    return blocks;
}

/// Composes all tiles of one material.
PackedPart composePart(const TileSources& sources, const Progress& progress)
{
    struct Worker {
        TileAccumulator sums;
        VoxelStore store;                // keeps the values of voxels
        VoxelStore lists;                // keeps the lists of blocks
        std::vector<PackedBlock> blocks; // of one tile
    };
    tbb::enumerable_thread_specific<Worker> workers;
    std::vector<TileBlocks> tiles(sources.tileCount());
    SharedProgress done(progress, tiles.size());
    tbb::parallel_for(std::size_t(0), tiles.size(), [&](std::size_t t) {
        Worker& worker = workers.local();
        worker.blocks.clear();
        sources.compose(t, worker.sums, worker.store, worker.blocks);
        tiles[t] = {reinterpret_cast<PackedBlock*>(
                        worker.lists.allocate(worker.blocks.size() * sizeof(PackedBlock))),
                    worker.blocks.size()};
        std::uninitialized_copy(worker.blocks.begin(), worker.blocks.end(), tiles[t].first);
        done.add();
    });
    PackedPart part = sources.emptyPart();
    part.blocks = inTreeOrder(sources, tiles);
    for (Worker& worker : workers) part.stores.push_back(std::move(worker.store));
    return part;
}

/// The bounds of each box's active voxels, in its own space; empty ones for a box without any.
std::vector<openvdb::BBoxd> boundsOf(const std::vector<Box>& boxes)
{
    std::vector<openvdb::BBoxd> bounds(boxes.size());
    for (std::size_t b = 0; b < boxes.size(); ++b)
        for (const VolumePart& part : boxes[b].volume.parts) {
            const openvdb::CoordBBox voxels = part.density->evalActiveVoxelBoundingBox();
            if (voxels.empty()) continue;
            const double edge = part.density->voxelSize()[0];
            bounds[b].expand((voxels.min().asVec3d() - Vec3d(0.5)) * edge);
            bounds[b].expand((voxels.max().asVec3d() + Vec3d(0.5)) * edge);
        }
    return bounds;
}

/// How far a coordinate of what is composed is from 0, world units.
double farthest(const std::vector<openvdb::BBoxd>& bounds, const PlacedScene& scene)
{
    double far = 0;
    for (const Placement& p : scene.boxes.placements) {
        const openvdb::BBoxd& box = bounds[p.box];
        if (box.empty()) continue;
        const Vec3d centre = (box.min() + box.max()) * 0.5, half = (box.max() - box.min()) * 0.5;
        const Vec3d x(p.x_axis), y(p.y_axis), z(p.z_axis);
        for (int i = 0; i < 3; ++i)
            far = std::max(
                far,
                std::abs(p.position[i]
                         + p.scale * (x[i] * centre[0] + y[i] * centre[1] + z[i] * centre[2]))
                    + p.scale
                        * (std::abs(x[i]) * half[0] + std::abs(y[i]) * half[1]
                           + std::abs(z[i]) * half[2]));
    }
    for (const Skin& skin : skinsOf(scene))
        for (const Vec3d& p : skin.surface().mesh().points)
            for (int i = 0; i < 3; ++i) far = std::max(far, std::abs(p[i]));
    return far;
}

/// Throws, before anything is packed, if the scene is more voxels wide than there can be.
void checkReach(const std::vector<openvdb::BBoxd>& bounds, const PlacedScene& scene, double voxel)
{
    const double far = farthest(bounds, scene);
    if (far < voxel * kFarthestVoxel) return;
    throw Error(fmt::format("compose: voxel: expected at least {:.3g} m for a scene that reaches "
                            "{:.4g} m from its origin (2^24 voxels), found {:g} m",
                            1.01 * far / kFarthestVoxel, far, voxel));
}

/// About how many pairs of a tile and a placement or triangle there are.
double pairsOf(const std::vector<openvdb::BBoxd>& bounds, const PlacedScene& scene, double voxel)
{
    const double tile = voxel * TileAccumulator::kSize;
    double pairs = 0;
    for (const Placement& p : scene.boxes.placements) {
        const openvdb::BBoxd& box = bounds[p.box];
        const double longest = box.empty() ? 0 : (box.max() - box.min()).length();
        pairs += std::pow(longest * p.scale / tile + 1, 3);
    }
    for (const Skin& skin : skinsOf(scene))
        pairs +=
            double(skin.surface().mesh().triangles.size()) + skin.surface().area() / (tile * tile);
    return pairs;
}

/// A weight for every tile by which estimatePart() draws it.
std::vector<double> samplingWeights(const TileSources& sources, std::size_t sample)
{
    std::vector<double> weights(sources.tileCount(), 1.0);
    if (weights.size() == sample) return weights; // each is composed once
    for (std::size_t t = 0; t < weights.size(); ++t)
        weights[t] = 4 + double(std::min<std::size_t>(sources.sourceCount(t), 1000));
    return weights;
}

/// Composes some tiles and adds to `e` what all tiles of the material would need.
void estimatePart(const TileSources& sources, ComposeEstimate& e)
{
    constexpr std::size_t kSample = 256;
    const std::size_t tiles = sources.tileCount(), sample = std::min(tiles, kSample);
    if (tiles == 0) return;
    // Systematic sampling: equal steps along the running sum of the weights.
    const std::vector<double> weights = samplingWeights(sources, sample);
    std::vector<double> end(tiles);
    std::partial_sum(weights.begin(), weights.end(), end.begin());
    const double step = end.back() / double(sample);
    TileAccumulator sums;
    double voxels = 0, blocks = 0;
    for (std::size_t k = 0; k < sample; ++k) {
        const auto t = static_cast<std::size_t>(
            std::upper_bound(end.begin(), end.end(), (double(k) + 0.5) * step) - end.begin());
        VoxelStore store;
        std::vector<PackedBlock> found;
        sources.compose(t, sums, store, found);
        const double factor = step / weights[t]; // tiles for which this one stands
        for (const PackedBlock& b : found) voxels += factor * b.count;
        blocks += factor * double(found.size());
    }
    const PackedPart part = sources.emptyPart();
    e.voxels += voxels;
    // Each block is kept twice for a while: in its tile's list and in that of the part.
    e.bytes += voxels * double(part.voxelBytes()) + blocks * 2 * sizeof(PackedBlock)
        + double(sources.bytes());
}

} // namespace

PackedVolume compose(const std::vector<Box>& boxes, const std::vector<Placement>& placements,
                     const ComposeParams& params, const Progress& progress)
{
    return compose(boxes, placedBoxes(placements), params, progress);
}

PackedVolume compose(const std::vector<Box>& boxes, const PlacedScene& scene,
                     const ComposeParams& params, const Progress& progress)
{
    checkComposeInput(boxes.size(), scene, params);
    checkReach(boundsOf(boxes), scene, params.voxel);
    const BoxSources packed = packBoxes(boxes, scene, params.voxel, params.keep);
    const BlockedTable blocked = findBlocked(packed, params.voxel, params.keep);
    PackedVolume volume;
    volume.transform = openvdb::math::Transform::createLinearTransform(params.voxel);
    for (std::size_t m = 0; m < packed.materials.size(); ++m) {
        const MaterialSources material(packed, scene, packed.materials[m]);
        const TargetSources sources(material, blocked, params);
        volume.parts.push_back(composePart(TileSources(sources), [&](double f) {
            report(progress, (double(m) + f) / double(packed.materials.size()));
        }));
    }
    if (volume.parts.empty()) volume.parts.emplace_back();
    report(progress, 1);
    return volume;
}

ComposeEstimate estimateCompose(const std::vector<Box>& boxes, const PlacedScene& scene,
                                const ComposeParams& params)
{
    checkComposeInput(boxes.size(), scene, params);
    const std::vector<openvdb::BBoxd> bounds = boundsOf(boxes);
    checkReach(bounds, scene, params.voxel);
    ComposeParams coarse = params;
    double factor = 1; // finer than the boxes, voxels grow with the cube of the resolution
    // What is far too large is told so soon: it is a bound by then, whatever the voxel.
    constexpr double kMostPairs = 2e7, kPairsOfABound = 2e6;
    const bool bound = pairsOf(bounds, scene, coarse.voxel) > kMostPairs;
    while (bound && pairsOf(bounds, scene, coarse.voxel) > kPairsOfABound && coarse.voxel < 1e30) {
        coarse.voxel *= 2;
        factor *= 8;
    }
    const BoxSources packed = packBoxes(boxes, scene, coarse.voxel, params.keep);
    // How much of the densities is kept hardly matters for an estimate, and takes time to find.
    const BlockedTable blocked = findBlocked(packed, coarse.voxel, Kept::integral);
    ComposeEstimate e;
    for (const std::string& name : packed.materials) {
        const MaterialSources material(packed, scene, name);
        const TargetSources sources(material, blocked, coarse);
        estimatePart(TileSources(sources), e);
    }
    e.voxels *= factor;
    e.bytes *= factor;
    e.bytes += double(scene.boxes.bytes());
    return e;
}

} // namespace volcomp
