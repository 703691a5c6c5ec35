// What a box grows: the parameters of the recursive function (MODEL section 6).
#pragma once

#include <cstdint>
#include <string>

#include "vec.h"

namespace volcomp {

class TableReader;

struct Primitive {
    std::string name;
    std::string material;      ///< of strands and stems
    int variants = 4;          ///< boxes baked, which differ by their random numbers only
    std::uint64_t seed = 1;
    double voxel = 0;          ///< edge of a voxel, metres; 0: from the thinnest feature worth showing

    void validate() const;
};

/// Reads a [box.NAME] table.
Primitive readPrimitive(TableReader& table, const std::string& name);

} // namespace volcomp
