// SPDX-License-Identifier: Apache-2.0
// The blocks of a volume file.
#pragma once

#include <atomic>
#include <cstddef>
#include <filesystem>
#include <string>

#include "volcomp/volume/block_source.h"

namespace volcomp {

/// Reads each block from the file when it is taken, and frees it: only the topology of the grids
/// and the blocks at hand are in memory. A file that is replaced meanwhile is read on as it was.
/// Where voxels are no cubes, the volume is read as a whole, and freed block by block.
class FileSource : public VolumeSource {
public:
    /// The caller has called openvdb::initialize(). Throws Error as readVolume().
    explicit FileSource(const std::filesystem::path& file, const std::string& grid = {});

    void take(const openvdb::Coord& block, BlockVoxels& voxels) const override;

private:
    FileSource(const std::filesystem::path& file, const Volume& volume);

    std::filesystem::path m_file;
    std::size_t m_forget_every; ///< blocks
    mutable std::atomic<std::size_t> m_count{0};
};

} // namespace volcomp
