// SPDX-License-Identifier: Apache-2.0
#include "volcomp/compose/box_pyramids.h"

#include <algorithm>

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
    BoxSources packed;
    packed.boxes.resize(boxes.size());
    packed.scales = scalesOf(scene, boxes.size());
    const auto addMaterial = [&](const std::string& m) {
        if (std::find(packed.materials.begin(), packed.materials.end(), m)
            == packed.materials.end())
            packed.materials.push_back(m);
    };
    for (std::size_t b = 0; b < boxes.size(); ++b)
        if (packed.scales[b].largest > 0)
            for (const VolumePart& part : boxes[b].volume.parts) {
                packed.boxes[b].push_back({packPart(part, boxes[b].name)});
                Pyramid& levels = packed.boxes[b].back();
                for (int n = levelFor(levels[0].voxel * packed.scales[b].smallest / voxel);
                     n > 0 && levels.back().voxels.size() > 1; --n)
                    levels.push_back(coarsen(levels.back(), keep));
                addMaterial(part.material);
            }
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
