// What the camera and the lights need of a scene: the finest voxel that the picture can show, and
// the boxes that matter to it.
#pragma once

#include <vector>

#include "volcomp/view/camera.h"
#include "volcomp/view/light.h"
#include "volcomp/place/scatter.h"
#include "volcomp/surface/surface.h"
#include "volcomp/volume/volume.h"

namespace volcomp {

/// True where a ball may be in the picture: a conservative test against the picture's four sides
/// and the plane of the eye.
bool mayBeInView(const Camera& camera, int width_pixels, int height_pixels, const Vec3d& centre,
                 double radius);

/// `pixels` times the edge of a pixel at the nearest point of the surfaces that the camera sees.
/// Looks at 20,000 points spread evenly over each surface and at most as many of its corners;
/// points behind a surface do not count. 0 where it sees none.
double voxelFromCamera(const std::vector<const Surface*>& surfaces, const Camera& camera,
                       int width_pixels, int height_pixels, double pixels);

/// The placements whose boxes are in the picture, or may throw a shadow on such a box. Their order
/// is kept.
std::vector<Placement> cullPlacements(const std::vector<Placement>& placements,
                                      const std::vector<Box>& boxes, const Camera& camera,
                                      int width_pixels, int height_pixels,
                                      const std::vector<Light>& lights);

} // namespace volcomp
