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
std::vector<BlockedFactors> blockedOf(const Pyramid& levels, double blocked_by_own,
                                      const Scales& scales, double voxel)
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
        if (least <= most)
            blocked[n] = BlockedFactors(levels[0], blocked_by_own, levels[n], least, most);
    }
    return blocked;
}

/// A part in its own voxels, and in coarser ones as far as the smallest placement needs them: the
/// step is rounded as it is for a placement, where 1/2 makes a difference.
Pyramid pyramidOf(SourcePart&& own, const Scales& scales, double voxel, Kept keep)
{
    Pyramid levels;
    levels.push_back(std::move(own));
    for (int n = levelFor(levels[0].voxel * scales.smallest / voxel);
         n > 0 && levels.back().voxels.size() > 1; --n)
        levels.push_back(coarsen(levels.back(), keep));
    return levels;
}

void dropVoxels(SourcePart& part)
{
    std::vector<SourceVoxel>().swap(part.voxels);
    std::vector<ScatterRatio>().swap(part.scatter_ratios);
    std::vector<BoundsList>().swap(part.bounds_of);
    for (std::vector<float>* list : {&part.squares, &part.x, &part.y, &part.z})
        std::vector<float>().swap(*list);
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

PackedBox packBox(const Box& box)
{
    PackedBox packed;
    packed.parts.reserve(box.volume.parts.size());
    for (const VolumePart& part : box.volume.parts)
        packed.parts.push_back(packPart(part, box.name));
    return packed;
}

BoxSources packBoxes(const std::vector<Box>& boxes, const PlacedScene& scene, double voxel,
                     Kept keep)
{
    const std::vector<Scales> scales = scalesOf(scene, boxes.size());
    std::vector<PackedBox> packed(boxes.size());
    for (std::size_t b = 0; b < boxes.size(); ++b)
        if (scales[b].largest > 0) packed[b] = packBox(boxes[b]);
    return packBoxes(std::move(packed), scene, voxel, keep);
}

BoxSources packBoxes(std::vector<PackedBox> boxes, const PlacedScene& scene, double voxel,
                     Kept keep)
{
    BoxSources packed;
    packed.boxes.resize(boxes.size());
    packed.blocked.resize(boxes.size());
    packed.scales = scalesOf(scene, boxes.size());
    tbb::parallel_for(std::size_t(0), boxes.size(), [&](std::size_t b) {
        if (packed.scales[b].largest > 0)
            for (SourcePart& part : boxes[b].parts) {
                packed.blocked[b].push_back(keep == Kept::blocked_light ? blockedBy(part) : 0);
                packed.boxes[b].push_back(
                    pyramidOf(std::move(part), packed.scales[b], voxel, keep));
            }
        boxes[b] = {};
    });
    const auto addMaterial = [&](const std::string& m) {
        if (std::find(packed.materials.begin(), packed.materials.end(), m)
            == packed.materials.end())
            packed.materials.push_back(m);
    };
    for (const Pyramids& parts : packed.boxes)
        for (const Pyramid& levels : parts) addMaterial(levels[0].material);
    for (const Skin& skin : skinsOf(scene)) addMaterial(skin.material());
    return packed;
}

void dropFiner(BoxSources& packed, double finest)
{
    for (std::size_t b = 0; b < packed.boxes.size(); ++b)
        for (Pyramid& levels : packed.boxes[b]) {
            const auto first = static_cast<std::size_t>(
                levelFor(levels[0].voxel * packed.scales[b].largest / finest));
            for (std::size_t n = 0; n < std::min(first, levels.size() - 1); ++n)
                dropVoxels(levels[n]);
        }
}

BlockedTable findBlocked(const BoxSources& packed, double voxel, Kept keep)
{
    BlockedTable table(packed.boxes.size());
    tbb::parallel_for(std::size_t(0), table.size(), [&](std::size_t b) {
        for (std::size_t p = 0; p < packed.boxes[b].size(); ++p) {
            const Pyramid& levels = packed.boxes[b][p];
            if (keep == Kept::blocked_light)
                table[b].push_back(
                    blockedOf(levels, packed.blocked[b][p], packed.scales[b], voxel));
            else table[b].emplace_back(levels.size());
        }
    });
    return table;
}

} // namespace volcomp
