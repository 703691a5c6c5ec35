// SPDX-License-Identifier: Apache-2.0
// The exact picture of a scene: what its strands, leaves and skins show, by rays at random.
#pragma once

#include <cstdint>

#include "tools/truth/embree_scene.h"
#include "tools/truth/paths.h"
#include "volcomp/base/progress.h"
#include "volcomp/view/image.h"

namespace volcomp {

/// How an exact picture is taken.
struct ExactParams {
    int samples = 64; ///< per pixel, at least 1, with halves 2
    std::uint64_t seed = 1;
    PathParams paths;
    /// Two independent halves of the samples, for pictureError(). Without them all samples are one
    /// jittered grid, as a renderer takes them, which has less noise.
    bool halves = true;
};

/// The picture of the scene's camera, size and pixel filter: what pathRadiance() says of what is
/// met, and behind everything the dome if it is visible, else the background. Its channels are R,
/// G, B and A, and half.R, half.G, half.B and half.A, the same by the first half of the samples
/// alone: so the two halves are independent pictures, and pictureError() can leave their noise out.
/// Without halves the picture has R, G, B and A alone. The bytes do not depend on the number of
/// threads. Throws Error if the camera or a setting is out of range.
Image exactPicture(const ExactScene& exact, const EmbreeScene& embree, const ExactParams& params,
                   const Progress& progress = {});

} // namespace volcomp
