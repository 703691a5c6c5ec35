// SPDX-License-Identifier: Apache-2.0
#include "volcomp/volume/vdb_file.h"

#include <cmath>
#include <new>

#include <fmt/format.h>
#include <openvdb/io/DelayedLoadMetadata.h>
#include <openvdb/openvdb.h>

namespace volcomp {
namespace {

namespace fs = std::filesystem;
using openvdb::Vec3d;

/// True if indices become places and these become the same indices, as far as numbers go. A
/// damaged file may hold inverses that belong to other scales.
bool canBeInverted(const openvdb::math::Transform& t)
{
    const openvdb::Mat4d m = t.baseMap()->getAffineMap()->getMat4();
    for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j)
            if (!std::isfinite(m(i, j))) return false;
    const Vec3d zero = m.row(3).getVec3();
    for (int a = 0; a < 3; ++a) {
        Vec3d e(0.0);
        e[a] = 1;
        const double edge = m.row(a).getVec3().length();
        // Far from the origin a place has fewer digits than an index.
        const double digits = 1e-6 + 1e-12 * zero.length() / edge;
        if (!(edge > 0) || !(std::abs(t.voxelSize()[a] - edge) <= 1e-6 * edge)
            || !((t.worldToIndex(t.indexToWorld(e)) - e).length() < digits))
            return false;
    }
    return true;
}

} // namespace

/// Calls f. OpenVDB's exceptions do not name the file; those that leave here do.
template <class F>
void VdbFile::guarded(F&& f) const
{
    try {
        f();
    } catch (const Error&) {
        throw;
    } catch (const std::bad_alloc&) { // no fault of the file
        throw;
    } catch (const std::exception& e) {
        throw fileError(m_path, "", "a complete VDB file",
                        std::string("one that cannot be read (") + e.what() + ")",
                        "It may be truncated or of another format; make it again.");
    }
}

VdbFile::VdbFile(const fs::path& file)
    : m_path(file), m_check(file), m_now(file.string()), m_later(file.string())
{
    // Files hold a table of where each leaf lies, which OpenVDB trusts. It reads the leaves
    // without.
    openvdb::io::DelayedLoadMetadata::unregisterType();
}

/// The file, opened so that leaves are read now or later.
openvdb::io::File& VdbFile::opened(LeavesRead leaves)
{
    openvdb::io::File& file = leaves == LeavesRead::now ? m_now : m_later;
    if (!file.isOpen())
        guarded([&] {
            file.setCopyMaxBytes(0); // read where it is, not copied first
            file.open(leaves == LeavesRead::when_touched);
        });
    return file;
}

openvdb::MetaMap VdbFile::metadata()
{
    openvdb::MetaMap result;
    guarded([&] { result = *opened(LeavesRead::when_touched).getMetadata(); });
    return result;
}

std::string VdbFile::identifier() const
{
    return m_check.uuid() + "-" + std::to_string(m_check.size());
}

openvdb::GridBase::Ptr VdbFile::readHead(const std::string& name)
{
    m_check.checkMetadata(name);
    openvdb::GridBase::Ptr grid;
    guarded([&] { grid = opened(LeavesRead::when_touched).readGridMetadata(name); });
    checkTransform(*grid, name);
    return grid;
}

openvdb::GridBase::Ptr VdbFile::readGrid(const std::string& name, LeavesRead leaves)
{
    m_check.checkGrid(name);
    openvdb::GridBase::Ptr grid;
    guarded([&] { grid = opened(leaves).readGrid(name); });
    checkTransform(*grid, name);
    return grid;
}

void VdbFile::checkTransform(const openvdb::GridBase& grid, const std::string& name) const
{
    const auto& t = grid.transform();
    const std::string place = "grid '" + name + "'";
    if (!t.isLinear())
        throw fileError(m_path, place, "a linear transform", "a " + t.mapType(),
                        "Resample the grid to cubic voxels in the program that made it.");
    bool good = false;
    guarded([&] { good = canBeInverted(t); });
    if (good) return;
    const openvdb::Mat4d m = t.baseMap()->getAffineMap()->getMat4();
    throw fileError(m_path, place, "a transform of finite numbers that can be inverted",
                    fmt::format("one with the rows [{:g}, {:g}, {:g}], [{:g}, {:g}, {:g}], [{:g}, "
                                "{:g}, {:g}], [{:g}, {:g}, {:g}]",
                                m(0, 0), m(0, 1), m(0, 2), m(1, 0), m(1, 1), m(1, 2), m(2, 0),
                                m(2, 1), m(2, 2), m(3, 0), m(3, 1), m(3, 2)));
}

} // namespace volcomp
