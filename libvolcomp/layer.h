// A layer: one kind of box over one surface, with the second densities that say where, how long and in what colour (MODEL section 7).
#pragma once

#include <string>

#include "vec.h"

namespace volcomp {

class TableReader;

struct Layer {
    std::string name;
    std::string box;       ///< name of a primitive
    std::string surface;   ///< name of a surface

    void validate() const;
};

/// Reads one [[layer]] table.
Layer readLayer(TableReader& table, int index);

} // namespace volcomp
