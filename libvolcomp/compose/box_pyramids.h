// SPDX-License-Identifier: Apache-2.0
// The boxes of a scene as compose() adds them: packed, in their own voxels and in coarser ones, and
// how much of their density is kept at a voxel of the composite.
#pragma once

#include <string>
#include <vector>

#include "volcomp/compose/blocked_light.h"
#include "volcomp/compose/box_source.h"
#include "volcomp/compose/compose_params.h"
#include "volcomp/place/placed_scene.h"

namespace volcomp {

/// One part of a box: with its own voxels, with voxels of twice the edge (coarsen()), and so on as
/// far as placements need it.
using Pyramid = std::vector<SourcePart>;
using Pyramids = std::vector<Pyramid>; ///< one for each material of a box

/// A box whose voxels are lists: a part for each of its materials. It takes a tenth of the memory
/// of the grids, or less.
struct PackedBox {
    std::vector<SourcePart> parts;
};

/// Throws the Errors of packPart().
PackedBox packBox(const Box& box);

/// Scales of a box's placements; 0 if it has none.
struct Scales {
    float smallest = 0, largest = 0;
};

/// Packed boxes, and the materials in the order in which they appear.
struct BoxSources {
    std::vector<Pyramids> boxes; ///< none for a box without placements
    std::vector<Scales> scales;  ///< of each box
    /// blockedBy() of each box's parts; 0 with Kept::integral, which does not ask for it.
    std::vector<std::vector<double>> blocked;
    std::vector<std::string> materials;

    std::size_t bytes() const; ///< of memory
};

/// Packs the boxes that are placed. `voxel` is the target's edge; with the same result any finer
/// target can be composed, too. Throws the Errors of packPart().
BoxSources packBoxes(const std::vector<Box>& boxes, const PlacedScene& scene, double voxel,
                     Kept keep);
/// The same of boxes that are packed already.
BoxSources packBoxes(std::vector<PackedBox> boxes, const PlacedScene& scene, double voxel,
                     Kept keep);

/// Lets go of the voxels that no placement adds to a target of this edge or a coarser one, because
/// coarser voxels of the box are added instead. What else is known of each level stays. Once the
/// factors have been found (findBlocked()), nobody needs them.
void dropFiner(BoxSources& packed, double finest);

/// Level of the pyramid for a box whose voxel, as placed, has `step` times the edge of the
/// target's: the coarsest level whose voxels are not larger than the target's.
int levelFor(double step);

/// The factors on the density of each box, each of its materials, and each level of its pyramid
/// that has placements, for one voxel of the target.
using BlockedTable = std::vector<std::vector<std::vector<BlockedFactors>>>;

/// Finds the factors for a target's edge that is not above the one for which the boxes were packed.
/// They follow from the scales of a box's placements at this edge, so that another edge has others.
/// With Kept::integral they are 1.
BlockedTable findBlocked(const BoxSources& packed, double voxel, Kept keep);

} // namespace volcomp
