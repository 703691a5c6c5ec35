#include "layer.h"

#include "toml_reader.h"

namespace volcomp {

void Layer::validate() const {}

Layer readLayer(TableReader& r, int index)
{
    Layer l;
    l.name = r.text({"name", "", "for messages and statistics"}, "layer" + std::to_string(index + 1));
    l.box = r.text({"box", "", "name of the box kind"}, std::nullopt);
    l.surface = r.text({"surface", "", "name of the surface"}, "");
    r.finish();
    return l;
}

} // namespace volcomp
