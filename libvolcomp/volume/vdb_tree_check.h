// SPDX-License-Identifier: Apache-2.0
// The part of vdb_check.h that goes through the tree of a grid.
#pragma once

#include <cstddef>
#include <cstdint>

#include "volcomp/volume/vdb_bytes.h"

namespace volcomp {

/// How the values of a grid are stored.
struct VdbValues {
    std::size_t bytes = 4;         ///< of a value in memory
    bool half = false;             ///< stored in half of them
    std::uint32_t compression = 0; ///< openvdb::io::COMPRESS_...
};

/// Goes over the topology and the buffers of a tree of type ..._5_4_3. Throws Error.
void checkVdbTree(VdbBytes& bytes, const VdbValues& values);

} // namespace volcomp
