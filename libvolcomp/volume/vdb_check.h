// SPDX-License-Identifier: Apache-2.0
// A check of VDB files, to be made before OpenVDB opens them.
//
// OpenVDB 10.0 takes every length, count, mask and position in a file for true: one wrong bit may
// have it write beyond its buffers, ask for 4 GB, or go round in circles. The check walks through
// the file in the order in which OpenVDB reads it, and needs for that the lengths, the masks and
// the headers of compressed chunks. Afterwards everything that OpenVDB reads lies inside of the
// file and fits its buffers. What is compressed is checked by those who decompress it.
//
// The format is that of openvdb::io::Archive, GridDescriptor, MetaMap, RootNode, InternalNode,
// LeafNode and io/Compression.h, versions 222 (OpenVDB 2.0, 2013) to 225.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "volcomp/volume/vdb_bytes.h"

namespace volcomp {

/// What a file says about one of its grids.
struct VdbGrid {
    std::string name;   ///< as openvdb::io::File::readGrid() takes it: "density", "density[1]"
    std::string type;   ///< "Tree_float_5_4_3"
    std::string parent; ///< the grid whose tree this one shares, or empty
    bool half = false;  ///< values are stored as half floats
    std::int64_t begin = 0, end = 0; ///< bytes of the file
};

class VdbCheck {
public:
    /// Checks the head of the file and the list of its grids, so that openvdb::io::File::open() is
    /// safe. Throws Error. The caller has called openvdb::initialize().
    explicit VdbCheck(const std::filesystem::path& file);

    const std::string& uuid() const { return m_uuid; }
    std::size_t size() const { return m_file.size(); } ///< bytes
    const std::vector<VdbGrid>& grids() const { return m_grids; }
    /// The grid of this name, or null.
    const VdbGrid* find(const std::string& name) const;

    /// Checks the metadata and the transform of a grid, so that readGridMetadata() is safe.
    void checkMetadata(const std::string& name) const;
    /// Checks all of a grid, so that readGrid() is safe. Throws Error, also for a grid whose type
    /// is neither float nor vec3s.
    void checkGrid(const std::string& name) const;

private:
    void readGrid(VdbBytes& bytes, bool has_positions);
    /// The grids that OpenVDB may take for this name.
    std::vector<VdbGrid> candidates(const std::string& name) const;

    MappedFile m_file;
    std::string m_uuid;
    std::vector<VdbGrid> m_grids;
};

} // namespace volcomp
