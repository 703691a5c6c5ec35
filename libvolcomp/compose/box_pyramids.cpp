// SPDX-License-Identifier: Apache-2.0
#include "volcomp/compose/box_pyramids.h"

#include <algorithm>
#include <utility>

#include <tbb/parallel_for.h>

#include "volcomp/compose/coarsen.h"
#include "volcomp/compose/skin.h"

namespace volcomp {
namespace {

/// The scales of each box.
std::vector<Scales> scalesOf(const PlacedScene& scene, std::size_t boxes)
{
    std::vector<Scales> scales(boxes);
    for (const Placement& p : scene.boxes.placements) {
        Scales& s = scales[p.box];
        s.smallest = s.largest == 0 ? p.scale : std::min(s.smallest, p.scale);
        s.largest = std::max(s.largest, p.scale);
    }
    return scales;
}

/// The factors of the levels that placements of these scales use.
std::vector<BlockedFactors> blockedOf(const Pyramid& levels, const Scales& scales, double voxel)
{
    const auto coarsest =
        static_cast<std::size_t>(levelFor(levels[0].voxel * scales.smallest / voxel));
    std::vector<BlockedFactors> blocked(std::min(levels.size(), coarsest + 1));
    for (std::size_t n = 0; n < blocked.size(); ++n) {
        // levelFor(): a level stands for steps of more than 1/2 up to 1, the first also for all
        // above, and the last for all below.
        const double edge = levels[n].voxel, smallest = edge * (scales.smallest / voxel),
                     largest = edge * (scales.largest / voxel),
                     least = std::max(smallest, n + 1 < blocked.size() ? 0.5 : 0.0),
                     most = n > 0 ? std::min(largest, 1.0) : largest;
        if (least <= most) blocked[n] = BlockedFactors(levels[0], levels[n], least, most);
    }
    return blocked;
}

Pyramids pyramidsOf(std::vector<SourcePart> parts, const Scales& scales, double voxel, Kept keep)
{
    Pyramids pyramids(parts.size());
    for (std::size_t p = 0; p < parts.size(); ++p) {
        Pyramid& levels = pyramids[p];
        levels.push_back(std::move(parts[p]));
        for (int n = levelFor(levels[0].voxel * scales.smallest / voxel);
             n > 0 && levels.back().voxels.size() > 1; --n)
            levels.push_back(coarsen(levels.back(), keep));
    }
    return pyramids;
}

std::size_t bytesOf(const SourcePart& p)
{
    std::size_t floats = p.squares.capacity() + p.x.capacity() + p.y.capacity() + p.z.capacity();
    for (const BoundsList& list : p.bounds_of)
        for (const auto& values : list.values) floats += values.capacity();
    return sizeof(p) + floats * sizeof(float) + p.voxels.capacity() * sizeof(SourceVoxel)
        + p.scatter_ratios.capacity() * sizeof(ScatterRatio);
}

} // namespace

int levelFor(double step)
{
    int level = 0;
    for (; level < 24 && step <= 0.5; step *= 2) ++level;
    return level;
}

std::size_t BoxSources::bytes() const
{
    std::size_t bytes = 0;
    for (const Pyramids& box : boxes)
        for (const Pyramid& levels : box)
            for (const SourcePart& part : levels) bytes += bytesOf(part);
    return bytes;
}

BoxSources packBoxes(const std::vector<Box>& boxes, const PlacedScene& scene, double voxel,
                     Kept keep)
{
    const std::vector<Scales> scales = scalesOf(scene, boxes.size());
    std::vector<PackedBox> packed(boxes.size());
    tbb::parallel_for(std::size_t(0), boxes.size(), [&](std::size_t b) {
        if (scales[b].largest > 0) packed[b] = packBox(boxes[b]);
    });
    return packBoxes(std::move(packed), scene, voxel, keep);
}

BoxSources packBoxes(std::vector<PackedBox> boxes, const PlacedScene& scene, double voxel,
                     Kept keep)
{
    BoxSources packed;
    packed.boxes.resize(boxes.size());
    packed.scales = scalesOf(scene, boxes.size());
    tbb::parallel_for(std::size_t(0), boxes.size(), [&](std::size_t b) {
        PackedBox box = std::move(boxes[b]);
        if (packed.scales[b].largest > 0)
            packed.boxes[b] = pyramidsOf(std::move(box.parts), packed.scales[b], voxel, keep);
    });
    const auto addMaterial = [&](const std::string& m) {
        if (std::find(packed.materials.begin(), packed.materials.end(), m)
            == packed.materials.end())
            packed.materials.push_back(m);
    };
    for (const Pyramids& box : packed.boxes)
        for (const Pyramid& levels : box) addMaterial(levels[0].material);
    for (const Skin& skin : skinsOf(scene)) addMaterial(skin.material());
    return packed;
}

BlockedTable findBlocked(const BoxSources& packed, double voxel, Kept keep)
{
    BlockedTable table(packed.boxes.size());
    tbb::parallel_for(std::size_t(0), table.size(), [&](std::size_t b) {
        for (const Pyramid& levels : packed.boxes[b])
            if (keep == Kept::blocked_light)
                table[b].push_back(blockedOf(levels, packed.scales[b], voxel));
            else table[b].emplace_back(levels.size());
    });
    return table;
}

} // namespace volcomp
