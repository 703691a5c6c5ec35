// SPDX-License-Identifier: Apache-2.0
// Room between what grows: roots that keep a distance from each other, and from other things.
#pragma once

#include <cstdint>
#include <vector>

#include "volcomp/place/layer.h"
#include "volcomp/place/placement.h"
#include "volcomp/surface/surface.h"

namespace volcomp {

/// A root that others keep away from.
struct Root {
    Vec3d position;
    double radius = 0; ///< half of its layer's spacing times its scale
};

/// The roots of one layer: what later layers keep away from.
std::vector<Root> rootsOf(const PlacementList& list, double spacing);

/// Marks, for PlacementList::filter(), those of a layer's placements that stay if no two roots may
/// be nearer than the sum of their radii, nor nearer than that to one of `others`. Darts are
/// thrown: each placement, in the order of the list, stays if there is room. As samples are random
/// within pieces of a curve that fills the surface, what stays is a Poisson-disk sample if there
/// are enough of them; in a random order it would have more of the low frequencies (0.10 of white
/// noise under half the first peak, not 0.09). One thread; time goes with the number of placements.
std::vector<char> keepSpacing(const PlacementList& list, const Layer& layer,
                              const std::vector<const std::vector<Root>*>& others);

/// Clears the marks of placements whose root is nearer than `distance` to one of `roots`.
void keepAway(const PlacementList& list, const std::vector<Root>& roots, double distance,
              std::vector<char>& keep);

/// The same for a surface. The same for any number of threads.
void keepAway(const PlacementList& list, const Surface& surface, double distance,
              std::vector<char>& keep);

} // namespace volcomp
