// SPDX-License-Identifier: Apache-2.0
// How much of a box's density is kept where it is spread over the voxels of a composite (MODEL
// section 8).
//
// A box's voxel that is turned and lies anywhere adds to four to eight voxels of the composite. Its
// strand then covers more area, thinner, and blocks more light than it did. So does one that is
// summed with emptiness into a coarser voxel.
#pragma once

#include <vector>

namespace volcomp {

struct SourcePart;

/// The factors on the density of one part of a box for which the light that it blocks, mean over
/// its three axes, stays what it is in the part's own voxels.
class BlockedFactors {
public:
    /// 1 everywhere: the integral of the density is kept.
    BlockedFactors() = default;
    /// `own` is the part as it was baked, `spread` the same or coarser voxels of it (coarsen()).
    /// These are placed with edges of `low` to `high` voxels of the composite. 1 everywhere if the
    /// part is more than kMostColumns voxels of the composite across. `blocked` is blockedBy(own).
    BlockedFactors(const SourcePart& own, double blocked, const SourcePart& spread, double low,
                   double high);

    /// The factor for voxels with an edge of `step` voxels of the composite.
    double at(double step) const;

    static constexpr double kMostColumns = 1 << 25;

private:
    struct Node {
        double step, factor;
    };
    std::vector<Node> m_nodes; ///< in increasing order of step
};

/// The area that a part blocks in its own voxels, summed over its axes, in columns of them. It is
/// the same whatever the composite. 0 if the part is more than BlockedFactors::kMostColumns across.
double blockedBy(const SourcePart& own);

} // namespace volcomp
