// SPDX-License-Identifier: Apache-2.0
#include "volcomp/scene/readers.h"

namespace volcomp {

ComposeParams readCompose(TableReader& r)
{
    ComposeParams c;
    c.voxel = r.number(
        {"voxel", "m",
         "edge of a voxel of a file; 0: from the camera and the picture. volcomp-render --boxes makes none that are finer"},
        c.voxel, kNotNegative);
    c.voxel_pixels = r.number(
        {"voxel_pixels", "pixels",
         "edge of a voxel at most, wherever the camera sees it (volcomp-render --boxes); in a file, if 'voxel' is 0, at the nearest point of a surface that it sees"},
        c.voxel_pixels, {0.01, 1000});
    c.keep = r.choice<Kept>(
        {"keep", "",
         "what of a box stays the same where its voxels are spread or made coarser: the light that it blocks, or the integral of its density"},
        c.keep, kKeptWords);
    c.minimum_density = r.number({"minimum_density", "1/m", "voxels below it are not kept"},
                                 c.minimum_density, kNotNegative);
    c.cull = r.flag({"cull", "", "leave out boxes that neither the camera sees nor a shadow needs"},
                    c.cull);
    r.finish();
    return c;
}

} // namespace volcomp
