// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/tree/voxel_levels.h"

#include <algorithm>
#include <cmath>

#include "volcomp/base/error.h"
#include "volcomp/base/interval.h"

namespace volcomp {
namespace {

constexpr double kVoxelsPerPixel = 1.5;    // width of a pixel where a level begins, its voxels
constexpr std::uint64_t kFewestVoxels = 8; // a level of fewer has no coarser one
// Distances from the camera, world units, in which a level is looked at.
struct Range {
    int level;
    double start, end;
};

// Distances from a point to the nearest and to the farthest point of a box; `low` and `high` are
// its corners.
std::pair<double, double> distancesTo(const Vec3d& low, const Vec3d& high, const Vec3d& from)
{
    double nearest = 0, farthest = 0;
    for (int a = 0; a < 3; ++a) {
        const double below = low[a] - from[a], above = high[a] - from[a];
        const double outside = std::max({below, -above, 0.0}),
                     most = std::max(std::abs(below), std::abs(above));
        nearest += outside * outside;
        farthest += most * most;
    }
    return {std::sqrt(nearest), std::sqrt(farthest)};
}

// The width of a pixel at distance 1 or, in an orthographic picture, at any.
double pixelOf(const Camera& camera, const RenderParams& params)
{
    return camera.projection == Projection::perspective
        ? 2 * std::tan(camera.field_of_view / 2) / params.width
        : camera.width / params.width;
}

// Where voxels of an edge begin to be at most `pixels` pixels wide.
double firstDistance(double voxel, const Camera& camera, const RenderParams& params, double pixels)
{
    const double ratio = voxel / (pixels * pixelOf(camera, params));
    if (camera.projection == Projection::perspective) return ratio;
    return ratio <= 1 ? 0 : kInfinity;
}

// The levels that a pixel needs on its way through a box, nearest first, as if there were any
// number of levels. `low` and `high` are the box's corners, in the axes and units of `eye`; `voxel`
// is the finest voxels' width.
std::vector<Range> rangesOf(const Vec3d& eye, const Vec3d& low, const Vec3d& high, double voxel,
                            const Camera& camera, const RenderParams& params)
{
    const auto [nearest, farthest] = distancesTo(low, high, eye);
    const bool perspective = camera.projection == Projection::perspective;
    const double pixel = pixelOf(camera, params);
    std::vector<Range> ranges;
    double start = 0;
    int level = 0;
    for (;; ++level) {
        // The width of a pixel where the next level begins, and how far away that is.
        const double width = voxel * std::ldexp(kVoxelsPerPixel, level + 1);
        const double next = perspective ? width / pixel : width <= pixel ? 0 : kInfinity;
        if (!(next <= farthest)) break;
        if (next <= nearest || next <= start) continue;
        ranges.push_back({level, start, next});
        start = next;
    }
    ranges.push_back({level, start, kInfinity});
    return ranges;
}

// Makes levels one after another, each from the one before.
class Maker {
public:
    Maker(std::shared_ptr<const VoxelTree> finest, double tau)
        : m_tree(std::move(finest)), m_tau(tau)
    {
    }

    bool hasNext() const { return !m_tree->empty() && m_tree->voxelCount() > kFewestVoxels; }
    void next()
    {
        m_tree = std::make_shared<const VoxelTree>(VoxelTree::coarser(*m_tree, m_tau));
        ++m_level;
    }
    int level() const { return m_level; }
    const std::shared_ptr<const VoxelTree>& tree() const { return m_tree; }

private:
    std::shared_ptr<const VoxelTree> m_tree;
    double m_tau;
    int m_level = 0;
};

// The trees of the ranges. treeAt(level) is called once for each, finest first. For a level that is
// coarser than all there are it gives the coarsest, always the same tree; such ranges become one.
template <class F>
std::vector<VoxelLevel> levelsFor(const std::vector<Range>& ranges, F&& treeAt)
{
    std::vector<VoxelLevel> levels;
    for (const Range& r : ranges) {
        std::shared_ptr<const VoxelTree> tree = treeAt(r.level);
        if (!levels.empty() && levels.back().tree == tree) levels.back().end = r.end;
        else levels.push_back({std::move(tree), r.start, r.end});
    }
    return levels;
}

// Corners of the leaves in world units, along the axes of the grid.
Vec3d lowCorner(const VoxelTree& tree) { return tree.bounds().min().asVec3d() * tree.voxelSize(); }
Vec3d highCorner(const VoxelTree& tree)
{
    return (tree.bounds().max().asVec3d() + Vec3d(1.0)) * tree.voxelSize();
}

} // namespace

std::vector<VoxelLevel> voxelLevels(std::shared_ptr<const VoxelTree> finest, const Camera& camera,
                                    const RenderParams& params)
{
    if (!params.lod || finest->empty()) return {{std::move(finest)}};
    const Vec3d eye = finest->toCorner(camera.eye) * finest->voxelSize();
    const std::vector<Range> ranges =
        rangesOf(eye, lowCorner(*finest), highCorner(*finest), finest->voxelSize(), camera, params);
    Maker maker(std::move(finest), params.tau);
    return levelsFor(ranges, [&](int level) {
        while (maker.level() < level && maker.hasNext()) maker.next();
        return maker.tree();
    });
}

int levelsNeeded(double finest_voxel, double farthest, const Camera& camera,
                 const RenderParams& params, double voxel_pixels)
{
    int levels = 1;
    while (levels < 40
           && firstDistance(std::ldexp(finest_voxel, levels), camera, params, voxel_pixels)
               < farthest)
        ++levels;
    return levels;
}

std::vector<std::shared_ptr<const VoxelTree>>
tileTrees(const std::vector<std::shared_ptr<const TileMaker>>& makers,
          const std::shared_ptr<TileBudget>& budget)
{
    std::vector<std::shared_ptr<const VoxelTree>> trees;
    trees.reserve(makers.size());
    for (const auto& maker : makers)
        trees.push_back(std::make_shared<const VoxelTree>(maker, budget));
    return trees;
}

std::vector<VoxelLevel> tileLevels(const std::vector<std::shared_ptr<const VoxelTree>>& trees,
                                   const Camera& camera, const RenderParams& params,
                                   double voxel_pixels)
{
    if (trees.empty()) throw Error("render: expected at least one level of voxels, found none");
    std::vector<VoxelLevel> all;
    all.reserve(trees.size());
    for (const auto& tree : trees) {
        VoxelLevel& level = all.emplace_back();
        level.tree = tree;
        if (all.size() == 1) continue;
        level.start = firstDistance(tree->voxelSize(), camera, params, voxel_pixels);
        all[all.size() - 2].end = level.start;
    }
    constexpr std::size_t kAround = 2; // levels coarser: cells of 8 voxels have 2 of those across
    for (std::size_t n = 0; n < all.size(); ++n)
        all[n].around = all[std::min(n + kAround, all.size() - 1)].tree;
    std::vector<VoxelLevel> levels;
    for (VoxelLevel& level : all)
        if (level.start < level.end) levels.push_back(std::move(level));
    return levels;
}

} // namespace volcomp
