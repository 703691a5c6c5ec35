// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/render_params.h"

#include <cmath>

#include "volcomp/base/error.h"

namespace volcomp {

bool RenderParams::hasBackdrop() const
{
    return (dome.visible && !dome.black()) || background.lengthSqr() > 0;
}

Vec3d RenderParams::backdrop(const Vec3d& d) const
{
    return dome.visible && !dome.black() ? dome.seen(d) : background;
}

void RenderParams::validate() const
{
    const auto fail = [](const char* expected) {
        throw Error(std::string("render: expected ") + expected);
    };
    const auto isRadiance = [](const Vec3d& c) {
        return c[0] >= 0 && c[1] >= 0 && c[2] >= 0 && std::isfinite(c.lengthSqr());
    };
    if (!(width >= 1 && width <= 32768 && height >= 1 && height <= 32768))
        fail("a width and a height of 1 to 32768 pixels");
    if (crop.width != 0
        && !(crop.x >= 0 && crop.y >= 0 && crop.width > 0 && crop.height > 0
             && crop.width <= width - crop.x && crop.height <= height - crop.y))
        fail("a crop inside the picture");
    if (!(samples >= 1 && samples <= 65536)) fail("1 to 65536 samples");
    if (!(pixel_radius >= 0 && pixel_radius <= 16)) fail("a pixel_radius of 0 to 16 pixels");
    if (!(tau >= 0 && std::isfinite(tau))) fail("a finite tau >= 0");
    if (!(step >= 0.001 && step <= 1000)) fail("a step of 0.001 to 1000 voxels");
    if (!(cutoff >= 0 && cutoff < 1)) fail("0 <= cutoff < 1");
    if (!isRadiance(background) || !isRadiance(ambient))
        fail("a finite background and ambient >= 0");
    if (!(light_samples >= 1 && light_samples <= 256)) fail("1 to 256 light_samples");
    dome.validate();
    haze.validate();
}

} // namespace volcomp
