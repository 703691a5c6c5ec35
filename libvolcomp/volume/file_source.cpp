// SPDX-License-Identifier: Apache-2.0
#include "volcomp/volume/file_source.h"

#include <algorithm>

#include "volcomp/volume/mapped_pages.h"
#include "volcomp/volume/vdb_io.h"

namespace volcomp {

FileSource::FileSource(const std::filesystem::path& file, const std::string& grid)
    : FileSource(file, readVolume(file, true, grid))
{
}

FileSource::FileSource(const std::filesystem::path& file, const Volume& volume)
    : VolumeSource(volume, TakenBlocks::freed, file.string()), m_file(file)
{
    // So about a hundredth of the mapped file is in memory at a time, or 8 MB. To forget takes as
    // long as to read some hundred blocks, and tiles are taken too.
    constexpr std::size_t kLeast = 1024;
    std::size_t leaves = 0;
    for (const VolumePart& part : volume.parts) leaves += part.density->tree().leafCount();
    m_forget_every = std::max(leaves / 100, kLeast);
}

void FileSource::take(const openvdb::Coord& block, BlockVoxels& voxels) const
{
    VolumeSource::take(block, voxels);
    if (++m_count % m_forget_every == 0) forgetMappedPages(m_file);
}

} // namespace volcomp
