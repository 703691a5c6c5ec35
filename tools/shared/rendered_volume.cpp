// SPDX-License-Identifier: Apache-2.0
#include "tools/shared/rendered_volume.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "tools/shared/memory.h"
#include "volcomp/base/error.h"
#include "volcomp/base/interval.h"
#include "volcomp/place/culling.h"

namespace volcomp {
namespace {

/// The edge of the finest voxels that the boxes have, as they are placed; infinite without any.
double finestOfBoxes(const PlacedScene& placed, const std::vector<BoxSize>& boxes)
{
    double finest = kInfinity;
    for (const Placement& p : placed.boxes.placements)
        finest = std::min(finest, boxes[p.box].voxel * p.scale);
    return finest;
}

/// The width of a pixel at a distance, world units.
double pixelAt(const Camera& camera, int width, double distance)
{
    return camera.projection == Projection::perspective
        ? 2 * std::tan(camera.field_of_view / 2) / width * distance
        : camera.width / width;
}

/// What cameras see, and the voxel that the nearest of it needs.
struct Wanted {
    double voxel = kInfinity, nearest = 0;
    int levels = 1; ///< from `floor` on, see wantedBy()
};

/// `floor` is the finest voxel that is of use.
Wanted wantedBy(const std::vector<Camera>& cameras, const Scene& scene, const PlacedScene& placed,
                const std::vector<BoxSize>& boxes, double floor)
{
    const int width = scene.render.width, height = scene.render.height;
    const double pixels = scene.compose.voxel_pixels;
    std::vector<BoxBall> balls;
    balls.reserve(boxes.size());
    for (const BoxSize& box : boxes) balls.push_back(box.ball);
    Wanted wanted;
    std::vector<double> farthest;
    farthest.reserve(cameras.size());
    for (const Camera& camera : cameras) {
        const ViewedRange range = viewedRange(placed.boxes, balls, camera, width, height);
        farthest.push_back(range.farthest);
        const double voxel = pixels * pixelAt(camera, width, range.nearest);
        if (range.farthest > 0 && voxel < wanted.voxel) {
            wanted.voxel = voxel;
            wanted.nearest = range.nearest;
        }
    }
    if (!(wanted.voxel < kInfinity)) wanted.voxel = 1; // nothing is seen
    for (std::size_t i = 0; i < cameras.size(); ++i)
        wanted.levels = std::max(wanted.levels,
                                 levelsNeeded(std::max(wanted.voxel, floor), farthest[i],
                                              cameras[i], scene.render, pixels));
    return wanted;
}

VoxelRange chooseRange(const Tool& tool, const Scene& scene, const std::vector<Camera>& cameras,
                       const PlacedScene& placed, const std::vector<BoxSize>& boxes)
{
    const double finest = finestOfBoxes(placed, boxes),
                 floor = std::max(scene.compose.voxel, finest < kInfinity ? finest : 0);
    const Wanted wanted = wantedBy(cameras, scene, placed, boxes, floor);
    const VoxelRange voxels{std::max(wanted.voxel, floor), wanted.levels};
    tool.say(fmt::format("{} of voxels, the finest {:.4g} m; the nearest box is {:.4g} m away{}",
                         voxels.levels == 1 ? "one level" : fmt::format("{} levels", voxels.levels),
                         voxels.finest, wanted.nearest,
                         floor > wanted.voxel ? fmt::format(
                             ", where {:g} of a pixel is {:.4g} m, but {}",
                             scene.compose.voxel_pixels, wanted.voxel,
                             floor > finest ? "compose.voxel is more" : "no box is baked finer")
                                              : ""));
    return voxels;
}

std::shared_ptr<TileBudget> budgetFor(const FromBoxes& from)
{
    constexpr double kMegabyte = 1048576, kLeast = 32, kShare = 0.8; // the rest is light's
    const double most = from.max_memory_mb > 0 ? from.max_memory_mb : 0.5 * machineMegabytes();
    const double left = kShare * (most - residentMegabytes());
    if (!(left >= kLeast))
        throw Error(
            fmt::format("--max-memory: expected at least {:.0f} MB for this scene, of which "
                        "boxes and placements take {:.0f}, found {:.0f} MB",
                        residentMegabytes() + kLeast / kShare, residentMegabytes(), most));
    return std::make_shared<TileBudget>(std::size_t(left * kMegabyte));
}

} // namespace

RenderedVolume volumeOfBoxes(Tool& tool, const Scene& scene, const FromBoxes& from)
{
    RenderedVolume volume;
    VirtualSceneOptions options;
    options.boxes = from.boxes;
    options.stale = from.stale;
    VoxelRange range{};
    options.voxels = [&](const PlacedScene& placed, const std::vector<BoxSize>& boxes) {
        volume.sizes = boxes;
        return range = chooseRange(tool, scene,
                                   from.cameras.empty() ? std::vector<Camera>{scene.camera}
                                                        : from.cameras,
                                   placed, boxes);
    };
    volume.made = virtualScene(tool, scene, options);
    volume.recipe = volume.made.recipe.hash();
    volume.identity = {{"recipe", volume.recipe},
                       {"finest voxel", range.finest},
                       {"voxel_pixels", scene.compose.voxel_pixels}};
    volume.name = from.boxes.string();
    const std::shared_ptr<TileBudget> budget = budgetFor(from);
    std::vector<std::shared_ptr<const TileMaker>> makers;
    makers.reserve(std::size_t(range.levels));
    for (int n = 0; n < range.levels; ++n)
        makers.emplace_back(std::shared_ptr<void>(), &volume.made.composite->level(n)); // not owned
    volume.trees = tileTrees(makers, budget);
    volume.levels =
        tileLevels(volume.trees, scene.camera, scene.render, scene.compose.voxel_pixels);
    return volume;
}

bool servesCamera(const RenderedVolume& volume, const Scene& scene)
{
    constexpr double kTolerance = 1 + 1e-6;
    const double finest = volume.trees[0]->voxelSize(),
                 floor = std::max(scene.compose.voxel,
                                  finestOfBoxes(*volume.made.placed, volume.sizes));
    const Wanted wanted =
        wantedBy({scene.camera}, scene, *volume.made.placed, volume.sizes, finest);
    return std::max(wanted.voxel, std::isfinite(floor) ? floor : 0) * kTolerance >= finest
        && wanted.levels <= int(volume.trees.size());
}

void reportTiles(Tool& tool, const RenderedVolume& volume)
{
    if (!volume.made.composite) return;
    nlohmann::json levels = nlohmann::json::array();
    std::size_t tiles = 0;
    for (const auto& tree : volume.trees) {
        const TileStore& store = *tree->tiles();
        tiles += store.tileCount();
        levels.push_back({{"voxel_m", tree->voxelSize()},
                          {"tiles_made", store.tileCount()},
                          {"lists_bytes", store.maker().memoryBytes()}});
    }
    const TileBudget& budget = volume.trees[0]->tiles()->budget();
    tool.stats["tiles"] = {{"levels", std::move(levels)},
                           {"placements", volume.made.placed->boxes.size()},
                           {"composite_bytes", volume.made.composite->memoryBytes()},
                           {"peak_bytes", budget.peak()},
                           {"most_bytes", budget.most()},
                           {"drops", budget.drops()},
                           {"process_peak_mb", peakMegabytes()}};
    tool.say(fmt::format(
        "{} tiles of 16^3 voxels made, at most {:.0f} MB of them at once, {:.0f} MB "
        "of memory in all{}",
        tiles, double(budget.peak()) / 1048576, peakMegabytes(),
        budget.drops() > 0
            ? fmt::format("; let go of {} times to stay within --max-memory", budget.drops())
            : ""));
}

} // namespace volcomp
