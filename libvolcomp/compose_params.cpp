#include "compose_params.h"

#include "toml_reader.h"

namespace volcomp {

void ComposeParams::validate() const {}

ComposeParams readCompose(TableReader& r)
{
    ComposeParams c;
    c.voxel = r.number({"voxel", "m", "edge of a voxel; 0: from the camera and the picture"}, c.voxel, kNotNegative);
    c.minimum_density = r.number({"minimum_density", "1/m", "voxels below it are not kept"}, c.minimum_density, kNotNegative);
    r.finish();
    return c;
}

} // namespace volcomp
