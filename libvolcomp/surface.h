// The surface that boxes stand on.
#pragma once

#include <filesystem>
#include <string>

#include "vec.h"

namespace volcomp {

class TableReader;

struct SurfaceSpec {
    std::string name;
    std::filesystem::path mesh;   ///< OBJ, PLY, OFF or STL

    void validate() const;
};

/// Reads a [surface.NAME] table.
SurfaceSpec readSurface(TableReader& table, const std::string& name);

} // namespace volcomp
