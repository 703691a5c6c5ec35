// SPDX-License-Identifier: Apache-2.0
// An open VDB file, whose bytes are checked before OpenVDB reads them.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <openvdb/io/File.h>

#include "volcomp/base/error.h"
#include "volcomp/volume/vdb_check.h"

namespace volcomp {

/// When the leaves of a grid are read.
enum class LeavesRead {
    now,
    when_touched ///< from the file, which stays open; if it is replaced, as it was
};

/// Every failure is an Error that names the file.
class VdbFile {
public:
    explicit VdbFile(const std::filesystem::path& file);

    const std::filesystem::path& path() const { return m_path; }
    const std::vector<VdbGrid>& grids() const { return m_check.grids(); }
    bool has(const std::string& name) const { return m_check.find(name) != nullptr; }
    openvdb::MetaMap metadata(); ///< of the file
    std::string identifier() const;

    /// A grid with its metadata and transform alone. Its transform is one that can be inverted.
    openvdb::GridBase::Ptr readHead(const std::string& name);
    /// Throws also if the grid is of another type.
    template <class Grid>
    typename Grid::Ptr read(const std::string& name, LeavesRead leaves)
    {
        const VdbGrid* const about = m_check.find(name);
        if (!about || about->type != Grid::gridType())
            throw fileError(m_path, "grid '" + name + "'", "type " + Grid::gridType(),
                            about ? "type " + about->type : "none");
        return openvdb::gridPtrCast<Grid>(readGrid(name, leaves));
    }

private:
    openvdb::GridBase::Ptr readGrid(const std::string& name, LeavesRead leaves);
    openvdb::io::File& opened(LeavesRead leaves);
    void checkTransform(const openvdb::GridBase& grid, const std::string& name) const;
    template <class F>
    void guarded(F&& f) const;

    std::filesystem::path m_path;
    VdbCheck m_check;
    openvdb::io::File m_now, m_later;
};

} // namespace volcomp
