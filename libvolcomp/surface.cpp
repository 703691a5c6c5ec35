#include "surface.h"

#include "toml_reader.h"

namespace volcomp {

void SurfaceSpec::validate() const {}

SurfaceSpec readSurface(TableReader& r, const std::string& name)
{
    SurfaceSpec s;
    s.name = name;
    s.mesh = r.path({"mesh", "", "OBJ, PLY, OFF or STL file"}, std::nullopt);
    r.finish();
    return s;
}

} // namespace volcomp
