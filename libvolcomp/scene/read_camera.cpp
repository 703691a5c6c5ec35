// SPDX-License-Identifier: Apache-2.0
#include "volcomp/scene/readers.h"

namespace volcomp {

Camera readCamera(TableReader& r)
{
    Camera c;
    c.projection = r.choice<Projection>(
        {"projection", "", "kind of camera"}, c.projection,
        {{"perspective", Projection::perspective}, {"orthographic", Projection::orthographic}});
    c.eye = r.vector({"eye", "m", "where the camera is"}, c.eye);
    c.target = r.vector({"target", "m", "what it looks at"}, c.target);
    c.up = r.direction({"up", "", "what is up in the picture"}, c.up);
    c.field_of_view = kDegree
        * r.number({"field_of_view_degrees", "degrees", "horizontal; perspective"}, 40,
                   {0.01, 170});
    c.width = r.number({"width", "m", "horizontal extent; orthographic"}, c.width, kPositive);
    r.require((c.target - c.eye).cross(c.up).length() > 1e-9 * (c.target - c.eye).length(),
              "target", "a point away from the eye, not straight along `up`");
    r.finish();
    return c;
}

} // namespace volcomp
