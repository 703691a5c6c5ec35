// SPDX-License-Identifier: Apache-2.0
// Suns in the image of a dome: what is too small and too bright to be light from all around.
#pragma once

#include <vector>

#include "volcomp/base/vec.h"
#include "volcomp/view/dome_image.h"

namespace volcomp {

/// A bright place that was taken out of an image.
struct DomeSun {
    Vec3d direction;  ///< to it, unit, in the image's axes
    Vec3d irradiance; ///< of a surface that faces it, beyond what is left there
    double disc;      ///< the whole angle of a disc of its size, radians
};

/// Finds the suns of an image, the brightest first, and takes them out of its texels; image.suns
/// keeps them.
///
/// A sun is a patch of texels that hang together, also by corners, and have luminances above 50
/// times the image's mean and above 1 / 100 of the patch's greatest. It covers at most 5 x 5
/// degrees and has at least 5 % of the image's light. Its texels, and those at its border, become
/// the mean of those around. Its size is that of an even disc: the square of its light over the sum
/// of the squares.
std::vector<DomeSun> takeSuns(DomeImage& image);

} // namespace volcomp
