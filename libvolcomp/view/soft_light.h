// SPDX-License-Identifier: Apache-2.0
// Soft lights as hard ones: a light that has a size stands for many that have none.
#pragma once

#include <vector>

#include "volcomp/view/light.h"

namespace volcomp {

/// Returns `count` (> 0) hard lights spread over a soft one, each of its whole strength: their mean
/// is the soft light. The directions of a directional light lie evenly over its disc, the places of
/// a spot or patch evenly over the disc across its direction. Those of a point light lie in its
/// ball so that the ball looks like an evenly bright disc from everywhere; as they lie evenly
/// around the middle, a matt surface in front of the ball receives what the middle would send.
///
/// The lights come in pairs on opposite sides, number i and number i + count / 2; if `count` is
/// odd, the last is the middle. So the mean direction or place is the light's own. One is the
/// middle itself, and so are all of a hard light.
std::vector<Light> hardLights(const Light& light, int count);

/// The size of each one's share of the soft light: a `disc` or a `radius` of 1 / sqrt(count).
Light shareOf(const Light& hard, const Light& soft, int count);

/// Moves a light to a place on its own disc or at its own radius, which `u` and `v` in [0, 1)
/// choose, for rays that can go there: many lights without it draw many hard shadows. A hard light
/// stays as it is.
Light movedInShare(const Light& light, double u, double v);

} // namespace volcomp
