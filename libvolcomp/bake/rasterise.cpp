// SPDX-License-Identifier: Apache-2.0
#include "volcomp/bake/rasterise.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include "volcomp/bake/leaf_filler.h"
#include "volcomp/base/error.h"
#include "volcomp/base/principal_direction.h"

namespace volcomp {
namespace {

using FloatLeaf = openvdb::FloatTree::LeafNodeType;
using VectorLeaf = openvdb::Vec3STree::LeafNodeType;

/// Voxels have coordinates between plus and minus half of this.
constexpr int kMaxCoordinate = 1 << 20;

/// The least optical depth of a voxel that is kept: less is not seen, and half floats do not hold
/// it.
constexpr float kLeastDepth = 1e-5f;

/// The most pairs that are found: 32 GB of them, and at least as much for what they fill. As each
/// segment makes one, the numbers of segments fit into 32 bits.
constexpr double kMostPairs = 2e9;

/// A segment touches a leaf.
struct Pair {
    std::uint64_t leaf; ///< see packed()
    std::uint32_t segment;
    bool operator<(const Pair& o) const
    {
        return leaf != o.leaf ? leaf < o.leaf : segment < o.segment;
    }
};

/// Returns a leaf's coordinates, in leaves, as a key that is sorted by x, then y, then z.
std::uint64_t packed(int x, int y, int z)
{
    const auto part = [](int v) {
        return static_cast<std::uint64_t>(v + (kMaxCoordinate >> 3)) & 0x1fffff;
    };
    return part(x) << 42 | part(y) << 21 | part(z);
}

/// Returns the first voxel of the leaf of a key.
openvdb::Coord unpacked(std::uint64_t key)
{
    const auto part = [](std::uint64_t v) {
        return (static_cast<int>(v & 0x1fffff) - (kMaxCoordinate >> 3)) * kLeaf;
    };
    return {part(key >> 42), part(key >> 21), part(key)};
}

/// How far from its axis a segment may reach, in leaves.
double reachInLeaves(const Segment& s, double voxel)
{
    return reachInCells(s, std::max(s.size_a, s.size_b) / voxel) / kLeaf + 1e-9;
}

/// Calls f(leaf key) for each leaf that the segment may touch. Walks along the segment, so that a
/// long one does not cost as much as the cuboid around it.
template <class F>
void forLeaves(const Segment& s, double voxel, F&& f)
{
    const CellLine cells = inCells(s, voxel);
    const Vec3d a = cells.a / kLeaf, d = cells.d / kLeaf;
    const double reach = reachInLeaves(s, voxel);
    // The layers along axis k that the part `range` of the segment reaches.
    const auto layers = [&](const LineRange& range, int k) {
        const double from = a[k] + d[k] * range.begin, to = a[k] + d[k] * range.end;
        return std::pair(static_cast<int>(std::floor(std::min(from, to) - reach)),
                         static_cast<int>(std::floor(std::max(from, to) + reach)));
    };
    // The part of `range` that may reach layer c along axis k, a little more for rounding.
    const auto within = [&](LineRange range, int k, int c) {
        if (d[k] == 0) return range;
        const double t0 = (c - reach - a[k]) / d[k], t1 = (c + 1 + reach - a[k]) / d[k];
        range.begin = std::max(range.begin, std::min(t0, t1) - 1e-9);
        range.end = std::min(range.end, std::max(t0, t1) + 1e-9);
        return range;
    };
    const LineRange all{0, 1};
    const auto [x_low, x_high] = layers(all, 0);
    const auto [y_low, y_high] = layers(all, 1);
    const auto [z_low, z_high] = layers(all, 2);
    if (x_low == x_high && y_low == y_high && z_low == z_high) {
        f(packed(x_low, y_low, z_low));
        return;
    }
    const auto touches = [&](int x, int y, int z) {
        const LineRange range = clippedToBox({0, 1 + 1e-12}, a, d, Vec3d(x, y, z) - Vec3d(reach),
                                             Vec3d(x + 1, y + 1, z + 1) + Vec3d(reach));
        return range.begin < range.end;
    };
    for (int x = x_low; x <= x_high; ++x) {
        const LineRange in_x = within(all, 0, x);
        const auto y = layers(in_x, 1);
        for (int j = std::max(y_low, y.first); j <= std::min(y_high, y.second); ++j) {
            const auto z = layers(within(in_x, 1, j), 2);
            for (int k = std::max(z_low, z.first); k <= std::min(z_high, z.second); ++k)
                if (touches(x, j, k)) f(packed(x, j, k));
        }
    }
}

/// Returns about how many leaves the segments touch, those of each segment counted, without
/// visiting any.
double leavesTouched(const std::vector<Segment>& segments, double voxel)
{
    double count = 0;
    for (const Segment& s : segments) {
        const Vec3d d = inCells(s, voxel).d / kLeaf;
        const double across = 2 * reachInLeaves(s, voxel) + 1;
        count += (std::abs(d[0]) + std::abs(d[1]) + std::abs(d[2]) + across) * across * across;
    }
    return count;
}

/// Returns all pairs, sorted by leaf and then by segment. Counts first, so that each pair is
/// written once to its place.
std::vector<Pair> findPairs(const std::vector<Segment>& segments, double voxel)
{
    constexpr std::size_t kChunk = 4096;
    const std::size_t chunks = (segments.size() + kChunk - 1) / kChunk;
    std::vector<std::size_t> first(chunks + 1, 0);
    const auto each = [&](auto&& work) {
        tbb::parallel_for(std::size_t(0), chunks, [&](std::size_t chunk) {
            work(chunk, chunk * kChunk, std::min(segments.size(), (chunk + 1) * kChunk));
        });
    };
    each([&](std::size_t chunk, std::size_t begin, std::size_t end) {
        std::size_t count = 0;
        for (std::size_t i = begin; i < end; ++i)
            forLeaves(segments[i], voxel, [&](std::uint64_t) { ++count; });
        first[chunk + 1] = count;
    });
    for (std::size_t c = 0; c < chunks; ++c) first[c + 1] += first[c];
    std::vector<Pair> pairs(first.back());
    each([&](std::size_t chunk, std::size_t begin, std::size_t end) {
        std::size_t at = first[chunk];
        for (std::size_t i = begin; i < end; ++i)
            forLeaves(segments[i], voxel, [&](std::uint64_t leaf) {
                pairs[at++] = {leaf, static_cast<std::uint32_t>(i)};
            });
    });
    tbb::parallel_sort(pairs.begin(), pairs.end());
    return pairs;
}

/// Throws Error if a segment or the voxel is out of range.
void check(const std::vector<Segment>& segments, double voxel)
{
    if (!(voxel >= kSmallestVoxel) || !std::isfinite(voxel))
        throw Error(fmt::format(
            "the voxel of a box: expected a length of at least {:g} m, found {:g} m; write smaller "
            "things in millimetres",
            kSmallestVoxel, voxel));
    double farthest = 0;
    for (const Segment& s : segments) {
        for (int k = 0; k < 3; ++k)
            farthest = std::max({farthest, std::abs(double(s.a[k])), std::abs(double(s.b[k]))});
        if (!(s.a + s.b + s.side + s.colour_a + s.colour_b).isFinite()
            || !std::isfinite(s.size_a + s.size_b) || s.size_a < 0 || s.size_b < 0)
            throw Error(fmt::format(
                "strand {} of a box has a position, size or colour that is not finite or is negative",
                s.strand));
        farthest = std::max({farthest, double(s.size_a), double(s.size_b)});
    }
    if (farthest / voxel > kMaxCoordinate / 2)
        throw Error(fmt::format(
            "a box reaches {:.4g} m from its root, more than {} voxels of {:.4g} m; a larger voxel is "
            "needed",
            farthest, kMaxCoordinate / 2, voxel));
    if (const double touched = leavesTouched(segments, voxel); touched > kMostPairs)
        throw Error(fmt::format(
            "the voxel of a box: {} segments fill about {:.2g} blocks of {}^3 voxels of {:.4g} m, more "
            "than {:.2g}; a larger voxel or thinner or fewer strands are needed",
            segments.size(), touched, kLeaf, voxel, kMostPairs));
}

bool oneColour(const std::vector<Segment>& segments)
{
    return std::all_of(segments.begin(), segments.end(), [&](const Segment& s) {
        return s.colour_a == segments.front().colour_a && s.colour_b == segments.front().colour_a;
    });
}

/// Returns a part without voxels: its grids, and its colour if all segments have the same one.
VolumePart emptyPart(const std::vector<Segment>& segments, const std::string& material,
                     MaterialKind kind, double voxel)
{
    VolumePart part;
    part.material = material;
    part.kind = kind;
    part.density = openvdb::FloatGrid::create(0.0f);
    part.density->setTransform(openvdb::math::Transform::createLinearTransform(voxel));
    part.density->setGridClass(openvdb::GRID_FOG_VOLUME);
    part.direction = openvdb::Vec3SGrid::create(Vec3f(0.0f));
    part.direction->setTransform(part.density->transform().copy());
    part.own_share = openvdb::FloatGrid::create(0.0f);
    part.own_share->setTransform(part.density->transform().copy());
    if (segments.empty()) return part;
    if (oneColour(segments)) {
        part.uniform_colour = segments.front().colour_a;
    } else {
        part.colour = openvdb::Vec3SGrid::create(Vec3f(0.0f));
        part.colour->setTransform(part.density->transform().copy());
    }
    return part;
}

/// The nodes that one leaf adds to the grids; null if it has no voxel that counts.
struct LeafNodes {
    std::unique_ptr<FloatLeaf> density, own_share;
    std::unique_ptr<VectorLeaf> direction, colour;
};

/// Returns the nodes of the leaf at `origin` with the voxels of the filler.
LeafNodes nodesOf(const LeafFiller& filler, const openvdb::Coord& origin, double voxel,
                  bool with_colour)
{
    LeafNodes nodes;
    for (int v = 0; v < kLeafVoxels; ++v) {
        const Cell& cell = filler.cells()[static_cast<std::size_t>(v)];
        if (!(cell.depth > kLeastDepth)) continue;
        if (!nodes.density) {
            nodes.density = std::make_unique<FloatLeaf>(origin, 0.0f, false);
            nodes.own_share = std::make_unique<FloatLeaf>(origin, 0.0f, false);
            nodes.direction = std::make_unique<VectorLeaf>(origin, Vec3f(0.0f), false);
            if (with_colour)
                nodes.colour = std::make_unique<VectorLeaf>(origin, Vec3f(0.0f), false);
        }
        const auto offset = static_cast<openvdb::Index>(v);
        nodes.density->setValueOn(offset, static_cast<float>(cell.depth / voxel));
        nodes.own_share->setValueOn(offset,
                                    std::min(1.0f, cell.squares / (cell.depth * cell.depth)));
        const auto& m = cell.tensor;
        nodes.direction->setValueOn(
            offset, Vec3f(principalDirection({m[0], m[1], m[2], m[3], m[4], m[5]}).stored()));
        if (with_colour) nodes.colour->setValueOn(offset, Vec3f(cell.colour.data()) / cell.weight);
    }
    return nodes;
}

} // namespace

VolumePart rasterise(const std::vector<Segment>& segments, const std::string& material,
                     MaterialKind kind, double voxel, const Progress& progress)
{
    check(segments, voxel);
    VolumePart part = emptyPart(segments, material, kind, voxel);
    const bool with_colour = part.colour != nullptr;

    const std::vector<Pair> pairs = findPairs(segments, voxel);
    std::vector<std::size_t> groups; // where the pairs of each leaf start, and their end
    for (std::size_t i = 0; i < pairs.size(); ++i)
        if (i == 0 || pairs[i].leaf != pairs[i - 1].leaf) groups.push_back(i);
    groups.push_back(pairs.size());

    std::vector<LeafNodes> leaves(groups.size() - 1);
    SharedProgress done(progress, leaves.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves.size(), 4),
                      [&](const tbb::blocked_range<std::size_t>& range) {
                          const auto filler = std::make_unique<LeafFiller>(segments, kind, voxel);
                          for (std::size_t g = range.begin(); g < range.end(); ++g) {
                              const openvdb::Coord origin = unpacked(pairs[groups[g]].leaf);
                              filler->begin(origin);
                              for (std::size_t i = groups[g]; i < groups[g + 1]; ++i)
                                  filler->add(pairs[i].segment);
                              filler->finishStrand();
                              leaves[g] = nodesOf(*filler, origin, voxel, with_colour);
                          }
                          done.add(range.size());
                      });
    for (LeafNodes& leaf : leaves) {
        if (!leaf.density) continue;
        part.density->tree().addLeaf(leaf.density.release());
        part.direction->tree().addLeaf(leaf.direction.release());
        part.own_share->tree().addLeaf(leaf.own_share.release());
        if (with_colour) part.colour->tree().addLeaf(leaf.colour.release());
    }
    report(progress, 1);
    return part;
}

} // namespace volcomp
