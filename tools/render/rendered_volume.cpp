// SPDX-License-Identifier: Apache-2.0
#include "tools/render/rendered_volume.h"

#include <algorithm>

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
double pixelAt(const Scene& scene, double distance)
{
    const Camera& camera = scene.camera;
    return camera.projection == Projection::perspective
        ? 2 * std::tan(camera.field_of_view / 2) / scene.render.width * distance
        : camera.width / scene.render.width;
}

VoxelRange chooseRange(const Tool& tool, const Scene& scene, const PlacedScene& placed,
                       const std::vector<BoxSize>& boxes)
{
    std::vector<BoxBall> balls;
    balls.reserve(boxes.size());
    for (const BoxSize& box : boxes) balls.push_back(box.ball);
    const ViewedRange range =
        viewedRange(placed.boxes, balls, scene.camera, scene.render.width, scene.render.height);
    const double pixels = scene.compose.voxel_pixels,
                 wanted = pixels * pixelAt(scene, range.nearest);
    double floor = std::max(scene.compose.voxel, finestOfBoxes(placed, boxes));
    if (!(floor < kInfinity)) floor = std::max(wanted, 1.0); // nothing is placed
    const VoxelRange voxels{
        std::max(wanted, floor),
        levelsNeeded(std::max(wanted, floor), range.farthest, scene.camera, scene.render, pixels)};
    tool.say(fmt::format(
        "{} of voxels, the finest {:.4g} m: at most {:g} of a pixel from {:.4g} m "
        "on{}",
        voxels.levels == 1 ? "one level" : fmt::format("{} levels", voxels.levels), voxels.finest,
        pixels, range.nearest * std::max(1.0, voxels.finest / std::max(wanted, 1e-300)),
        floor > wanted ? fmt::format(", where finer boxes would be needed before") : ""));
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
        return range = chooseRange(tool, scene, placed, boxes);
    };
    volume.made = virtualScene(tool, scene, options);
    volume.recipe = volume.made.recipe.hash();
    volume.identity = {{"recipe", volume.recipe},
                       {"finest voxel", range.finest},
                       {"voxel_pixels", scene.compose.voxel_pixels}};
    volume.name = from.boxes.string();
    const std::shared_ptr<TileBudget> budget = budgetFor(from);
    std::vector<std::shared_ptr<const TileMaker>> makers;
    for (int n = 0; n < range.levels; ++n)
        makers.emplace_back(std::shared_ptr<void>(), &volume.made.composite->level(n)); // not owned
    volume.levels =
        tileLevels(makers, budget, scene.camera, scene.render, scene.compose.voxel_pixels);
    return volume;
}

void reportTiles(Tool& tool, const RenderedVolume& volume)
{
    if (!volume.made.composite) return;
    nlohmann::json levels = nlohmann::json::array();
    std::size_t tiles = 0;
    for (const VoxelLevel& level : volume.levels) {
        const TileStore& store = *level.tree->tiles();
        tiles += store.tileCount();
        levels.push_back({{"voxel_m", level.tree->voxelSize()},
                          {"from_m", level.start},
                          {"tiles_made", store.tileCount()},
                          {"lists_bytes", store.maker().memoryBytes()}});
    }
    const TileBudget& budget = volume.levels[0].tree->tiles()->budget();
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
