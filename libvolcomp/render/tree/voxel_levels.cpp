// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/tree/voxel_levels.h"

#include <algorithm>
#include <cmath>

#include "volcomp/base/error.h"
#include "volcomp/base/interval.h"
#include "volcomp/render/tree/voxel_tree_io.h"
#include "volcomp/volume/vdb_io.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;

constexpr double kVoxelsPerPixel = 1.5;    // width of a pixel where a level begins, its voxels
constexpr std::uint64_t kFewestVoxels = 8; // a level of fewer has no coarser one
// Raised when files of levels change their meaning. Those of volcomp 0.1.0 have no such number, and
// their scatter ratios are in grids `shown`.
constexpr std::int32_t kVersion = 2;
constexpr const char* kVersionKey = "volcomp_levels_version";
constexpr const char* kOf = "volcomp_levels_of";
constexpr const char* kTau = "volcomp_tau";
constexpr const char* kLast = "volcomp_levels_last";
constexpr const char* kVoxel = "volcomp_levels_voxel";
constexpr const char* kLow = "volcomp_levels_low";
constexpr const char* kHigh = "volcomp_levels_high";

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

// The files of levels beside a volume, and what they say of the volume.
struct Stored {
    int count = 0; // levels; 0: none, or not all, or of something else
    double voxel = 0;
    Vec3d low{0.0}, high{0.0};
};

// A level beside the volume's own counts if all levels down to the last are there, were made of the
// file as it is and for this tau, and have the meaning that they have here.
Stored stored(const fs::path& volume, double tau, const std::string& grid)
{
    Stored s;
    std::error_code code; // a file that cannot be looked at is none
    std::string of;
    for (int n = 1; fs::is_regular_file(levelFile(volume, n), code); ++n) {
        openvdb::MetaMap meta;
        try {
            meta = readVolumeMetadata(levelFile(volume, n));
        } catch (const Error&) { // damaged: as good as missing
            break;
        }
        const auto is = [&](const char* key, const auto& value) {
            const auto found =
                meta.getMetadata<openvdb::TypedMetadata<std::decay_t<decltype(value)>>>(key);
            return found && found->value() == value;
        };
        if (of.empty()) of = volumeIdentifier(volume, grid);
        if (!is(kVersionKey, kVersion) || !is(kOf, of) || !is(kTau, tau)) break;
        if (!is(kLast, true)) continue;
        const auto voxel = meta.getMetadata<openvdb::DoubleMetadata>(kVoxel);
        const auto low = meta.getMetadata<openvdb::Vec3DMetadata>(kLow),
                   high = meta.getMetadata<openvdb::Vec3DMetadata>(kHigh);
        if (voxel && low && high) s = {n, voxel->value(), low->value(), high->value()};
        break;
    }
    return s;
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

std::vector<VoxelLevel> readVoxelLevels(const fs::path& volume, const Camera& camera,
                                        const RenderParams& params, const Progress& progress,
                                        const std::string& grid)
{
    const Stored s = params.lod ? stored(volume, params.tau, grid) : Stored();
    if (s.count == 0)
        return voxelLevels(std::make_shared<const VoxelTree>(readVoxelTree(volume, progress, grid)),
                           camera, params);
    int last = -1;
    std::shared_ptr<const VoxelTree> tree;
    return levelsFor(rangesOf(camera.eye, s.low, s.high, s.voxel, camera, params), [&](int level) {
        level = std::min(level, s.count);
        if (level == last) return tree;
        const Progress next = last < 0 ? progress : Progress(); // the finest takes longest by far
        last = level;
        return tree = std::make_shared<const VoxelTree>(
                   level == 0 ? readVoxelTree(volume, next, grid)
                              : readVoxelTree(levelFile(volume, level), next));
    });
}

int storedLevels(const fs::path& volume, double tau, const std::string& grid)
{
    return stored(volume, tau, grid).count;
}

fs::path levelFile(const fs::path& volume, int n)
{
    fs::path file = volume;
    return file.replace_extension(".level" + std::to_string(n) + ".vdb");
}

void writeVoxelLevels(const fs::path& volume, double tau, const Progress& progress,
                      const std::string& grid)
{
    openvdb::MetaMap meta;
    meta.insertMeta(kVersionKey, openvdb::Int32Metadata(kVersion));
    meta.insertMeta(kOf, openvdb::StringMetadata(volumeIdentifier(volume, grid)));
    meta.insertMeta(kTau, openvdb::DoubleMetadata(tau));
    Maker maker(std::make_shared<const VoxelTree>(readVoxelTree(
                    volume, [&](double done) { report(progress, 0.4 * done); }, grid)),
                tau);
    const VoxelTree& finest = *maker.tree();
    meta.insertMeta(kVoxel, openvdb::DoubleMetadata(finest.voxelSize()));
    meta.insertMeta(kLow, openvdb::Vec3DMetadata(finest.origin() + lowCorner(finest)));
    meta.insertMeta(kHigh, openvdb::Vec3DMetadata(finest.origin() + highCorner(finest)));
    double done = 0.4;
    while (maker.hasNext()) {
        maker.next();
        if (maker.tree()->voxelCount() >> 28)
            throw fileError(volume, "", "less than 2^28 voxels in each level to write",
                            std::to_string(maker.tree()->voxelCount()),
                            "Render without files of levels.");
        meta.insertMeta(kLast, openvdb::BoolMetadata(!maker.hasNext()));
        writeVolume(levelFile(volume, maker.level()), packedVolume(*maker.tree()), meta);
        report(progress, done += (1 - done) * 0.7);
    }
}

} // namespace volcomp
