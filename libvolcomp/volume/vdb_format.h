// SPDX-License-Identifier: Apache-2.0
// What the reader and the writer of VDB files (vdb_io.h) share: names of grids and metadata.
#pragma once

#include <string>

#include <openvdb/version.h>

#include "volcomp/volume/material.h"
#include "volcomp/volume/vdb_io.h"

namespace volcomp {

// vdb_write.cpp writes the bytes of leaves itself, and vdb_check.cpp goes over all bytes itself.
// Both are as in files of these versions. With another, compare LeafNode::writeBuffers(),
// io::Archive and io::GridDescriptor with those of OpenVDB 10.0, and run vdb_io_test, which holds
// our bytes against OpenVDB's.
static_assert(openvdb::OPENVDB_FILE_VERSION == 224 || openvdb::OPENVDB_FILE_VERSION == 225,
              "a new format of VDB files: see the comment above");

inline const std::string kDensity = "density";
constexpr const char* kMaterial = "volcomp_material";
constexpr const char* kKind = "volcomp_kind";
constexpr const char* kColour = "volcomp_colour";
constexpr const char* kDirection = "volcomp_direction";
constexpr const char* kScatterRatio = "volcomp_scatter_ratio";
constexpr const char* kOwnShare = "volcomp_own_share";
constexpr const char* kShown = "volcomp_shown"; ///< what volcomp 0.1.0 called the same

inline const char* directionName(MaterialKind kind)
{
    return kind == MaterialKind::fibre ? "tangentu" : "N";
}
inline const char* colourName(GridNames names)
{
    return names == GridNames::houdini ? "Cd" : "color";
}

} // namespace volcomp
