#include "primitive.h"

#include "toml_reader.h"

namespace volcomp {

void Primitive::validate() const {}

Primitive readPrimitive(TableReader& r, const std::string& name)
{
    Primitive p;
    p.name = name;
    p.material = r.text({"material", "", "name of the material"}, std::nullopt);
    p.variants = r.integer({"variants", "", "boxes baked, which differ by their random numbers only"}, p.variants, {1, 1000});
    p.seed = static_cast<std::uint64_t>(r.integer({"seed", "", "of the random numbers"}, 1, {0, kInfinity}));
    p.voxel = r.number({"voxel", "m", "edge of a voxel; 0: from the thinnest feature worth showing"}, p.voxel, kNotNegative);
    r.finish();
    return p;
}

} // namespace volcomp
