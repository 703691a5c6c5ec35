// SPDX-License-Identifier: Apache-2.0
// The light that one segment of a ray scatters to the eye: a sum over places in the segment, as few
// as the wanted error allows.
//
// The optical depth D to a light is no smooth function of the place inside a voxel. For a light
// along an axis it jumps at the voxel's faces, near an axis it has steep kinks there, and for other
// directions it has a kink wherever the way to the light crosses an edge of a voxel (box filter).
// So D is only ever asked for inside of a segment, never at its ends, and is taken as linear only
// between places that were found to lie on a line.
//
// Places are counted by the share v of what the segment shows, 0 to 1, not by the length: a third
// of v is a third of what the eye sees of the segment, however dense that is. D is first looked up
// at v = 1/2. If the whole segment adds little to the pixel, this is all. Otherwise D is looked up
// at 1/6 and 5/6, too, which are the middles of the outer thirds. If the three lie on a line, as
// they do in a homogeneous body, the sum is exact; if not, and the difference counts in the pixel,
// each third is treated in the same way.
#pragma once

#include "volcomp/render/march/segment.h"

namespace volcomp {

struct SegmentLight {
    double light, depth;
};

/// The light of light `l` that reaches the segment and is sent to its begin, over what
/// Shading::from_light has of it. D is measured from places that are Shading::light_start nearer to
/// the light, so that strands do not shade themselves. `opacity` is what the segment takes of the
/// light that passes along the ray; `sample` has what lies before it. Counts its rays in `scratch`.
///
/// SegmentLight::depth is D at about v = 1/2, infinite in the dark, 0 without shadows.
SegmentLight lightOfSegment(const MarchScene& scene, std::size_t l, const RaySegment& segment,
                            double opacity, const RaySample& sample, RayScratch& scratch);

/// That depth alone, for segments that reflect nothing of the light itself: from the sweep without
/// marching if it knows the place, else by a ray. `weight` is the share of the pixel that shows the
/// segment.
double depthOfSegment(const MarchScene& scene, std::size_t l, const RaySegment& segment,
                      double weight, RayScratch& scratch);

/// The place u on a segment, 0 at its begin and 1 at its end, before which the share `x` of the
/// segment's own optical depth lies; x is in [0, 1].
double placeAtShare(const RaySegment& segment, double x);

} // namespace volcomp
