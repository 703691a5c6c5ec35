// SPDX-License-Identifier: Apache-2.0
#include "volcomp/volume/vdb_check.h"

#include <algorithm>

#include <fmt/format.h>
#include <openvdb/io/Compression.h>
#include <openvdb/io/DelayedLoadMetadata.h>
#include <openvdb/openvdb.h>

#include "volcomp/base/error.h"
#include "volcomp/volume/vdb_tree_check.h"

namespace volcomp {
namespace {

constexpr std::uint32_t kOldest = openvdb::OPENVDB_FILE_VERSION_NODE_MASK_COMPRESSION,
                        kNewest = 225;
constexpr int kUuid = 36;        // letters
constexpr char kNumber = '\x1e'; // between a name and the number of several grids of that name
const std::string kHalf = "_HalfFloat"; // behind the type of grids of half floats
const std::string kSavedAsHalf = "is_saved_as_half_float"; // key of metadata

/// The name as OpenVDB shows it and takes it: NAME[NUMBER].
std::string shownName(const std::string& name)
{
    const std::size_t at = name.find(kNumber);
    if (at == std::string::npos) return name;
    return name.substr(0, at) + "[" + name.substr(at + 1) + "]";
}

/// Goes over a value of metadata, whose type and length are known. What OpenVDB reads is the length
/// of the type, whatever length the file says.
void skipValue(VdbBytes& bytes, const std::string& type)
{
    const auto length = bytes.take<std::uint32_t>();
    // OpenVDB reads a text, and what it does not know, by the length in the file. We keep it from
    // knowing the table of delayed loading (vdb_file.cpp).
    if (type != openvdb::StringMetadata::staticTypeName()
        && type != openvdb::io::DelayedLoadMetadata::staticTypeName()
        && openvdb::Metadata::isRegisteredType(type))
        if (const auto size = openvdb::Metadata::createMetadata(type)->size(); size != length)
            bytes.fail(fmt::format("{} bytes of metadata of type {}", size, type),
                       fmt::format("{}", length));
    bytes.skip(length);
}

/// Goes over metadata. Returns whether it says that the grid's floats are half ones: OpenVDB goes
/// by this and not by the grid's type.
bool skipMetadata(VdbBytes& bytes)
{
    bool half = false;
    for (auto count = bytes.take<std::uint32_t>(); count > 0; --count) {
        const std::string name = bytes.text(), type = bytes.text();
        const std::size_t value = bytes.at() + sizeof(std::uint32_t);
        skipValue(bytes, type);
        if (name != kSavedAsHalf) continue;
        if (type != openvdb::BoolMetadata::staticTypeName())
            bytes.fail("metadata '" + kSavedAsHalf + "' of type bool", "type " + type);
        half = bytes.of(value)[0] != std::byte(0);
    }
    return half;
}

void skipTransform(VdbBytes& bytes)
{
    const std::string type = bytes.text();
    constexpr std::size_t kVector = 3 * sizeof(double), kMatrix = 16 * sizeof(double);
    if (type == "AffineMap" || type == "UnitaryMap") bytes.skip(kMatrix);
    else if (type == "ScaleMap" || type == "UniformScaleMap") bytes.skip(5 * kVector);
    else if (type == "ScaleTranslateMap" || type == "UniformScaleTranslateMap")
        bytes.skip(6 * kVector);
    else if (type == "TranslationMap") bytes.skip(kVector);
    else if (type == "NonlinearFrustumMap") {
        bytes.skip(2 * kVector + 2 * sizeof(double)); // box, taper, depth
        if (bytes.text() != "AffineMap") bytes.fail("an AffineMap in the frustum", "another map");
        bytes.skip(kMatrix);
    } else bytes.fail("a transform that OpenVDB knows", "'" + type + "'");
}

/// The head of a grid: how its values are compressed, metadata, transform. Returns how its values
/// are stored.
VdbValues skipGridHead(VdbBytes& bytes, const VdbGrid& grid)
{
    VdbValues values;
    values.bytes = grid.type == openvdb::Vec3SGrid::gridType() ? 3 * sizeof(float) : sizeof(float);
    values.half = grid.half;
    values.compression = bytes.take<std::uint32_t>();
    using namespace openvdb::io;
    if (values.compression & ~std::uint32_t(COMPRESS_ZIP | COMPRESS_ACTIVE_MASK | COMPRESS_BLOSC))
        bytes.fail("a compression that OpenVDB knows", fmt::format("{}", values.compression));
    if (skipMetadata(bytes) != grid.half)
        bytes.fail(fmt::format("that the metadata calls the floats {} as the type does",
                               grid.half ? "half" : "whole"),
                   "the opposite");
    skipTransform(bytes);
    return values;
}

bool hasKnownTree(const VdbGrid& grid)
{
    return grid.type == openvdb::FloatGrid::gridType()
        || grid.type == openvdb::Vec3SGrid::gridType();
}

/// All of a grid, from `bytes` on. An instance has no tree of its own.
void skipGrid(VdbBytes& bytes, const VdbGrid& grid)
{
    if (!hasKnownTree(grid))
        bytes.fail("type " + openvdb::FloatGrid::gridType() + " or "
                       + openvdb::Vec3SGrid::gridType(),
                   "type " + grid.type);
    const VdbValues values = skipGridHead(bytes, grid);
    if (grid.parent.empty()) checkVdbTree(bytes, values);
}

/// The name without the number of several grids of one name.
std::string bareName(const std::string& name)
{
    const std::size_t at = name.rfind('[');
    return at == std::string::npos || name.back() != ']' ? name : name.substr(0, at);
}

} // namespace

VdbCheck::VdbCheck(const std::filesystem::path& file) : m_file(file)
{
    VdbBytes bytes(m_file);
    if (bytes.take<std::int64_t>() != openvdb::OPENVDB_MAGIC) {
        bytes.moveTo(0, "");
        bytes.fail("a VDB file", "another one");
    }
    const auto version = bytes.take<std::uint32_t>();
    if (version < kOldest || version > kNewest)
        bytes.fail(fmt::format("a VDB file of version {} to {}", kOldest, kNewest),
                   fmt::format("version {}", version));
    bytes.skip(2 * sizeof(std::uint32_t)); // version of the library
    const bool has_positions = bytes.take<std::uint8_t>() != 0;
    m_uuid.assign(reinterpret_cast<const char*>(bytes.skip(kUuid)), kUuid);
    skipMetadata(bytes);
    const auto count = bytes.take<std::int32_t>();
    if (count < 0) bytes.fail("a number of grids", fmt::format("{}", count));
    for (std::int32_t i = 0; i < count; ++i) readGrid(bytes, has_positions);
}

void VdbCheck::readGrid(VdbBytes& bytes, bool has_positions)
{
    VdbGrid grid;
    grid.name = shownName(bytes.text());
    grid.type = bytes.text();
    grid.parent = shownName(bytes.text());
    if (grid.type.size() > kHalf.size()
        && grid.type.compare(grid.type.size() - kHalf.size(), kHalf.size(), kHalf) == 0) {
        grid.half = true;
        grid.type.resize(grid.type.size() - kHalf.size());
    }
    if (find(grid.name)) bytes.fail("each grid once", "'" + grid.name + "' twice");
    grid.begin = bytes.take<std::int64_t>();
    bytes.skip(sizeof(std::int64_t)); // of the buffers: OpenVDB goes on behind the topology
    grid.end = bytes.take<std::int64_t>();
    if (!has_positions) { // OpenVDB reads all grids at once
        grid.begin = static_cast<std::int64_t>(bytes.at());
        skipGrid(bytes, grid);
        grid.end = static_cast<std::int64_t>(bytes.at());
    } else {
        const auto here = static_cast<std::int64_t>(bytes.at());
        if (grid.begin < here || grid.end < grid.begin)
            bytes.fail("that grid '" + grid.name + "' lies behind its name",
                       fmt::format("bytes {} to {}", grid.begin, grid.end));
        bytes.moveTo(grid.end, "a grid's end");
    }
    m_grids.push_back(std::move(grid));
}

const VdbGrid* VdbCheck::find(const std::string& name) const
{
    const auto at = std::find_if(m_grids.begin(), m_grids.end(),
                                 [&](const VdbGrid& g) { return g.name == name; });
    return at == m_grids.end() ? nullptr : &*at;
}

std::vector<VdbGrid> VdbCheck::candidates(const std::string& name) const
{
    std::vector<VdbGrid> found;
    for (const VdbGrid& grid : m_grids)
        if (grid.name == name || bareName(grid.name) == name) found.push_back(grid);
    return found;
}

void VdbCheck::checkMetadata(const std::string& name) const
{
    for (const VdbGrid& grid : candidates(name)) {
        VdbBytes bytes(m_file, grid.name);
        bytes.moveTo(grid.begin, "the grid");
        skipGridHead(bytes, grid);
    }
}

void VdbCheck::checkGrid(const std::string& name) const
{
    const auto check = [&](const VdbGrid& grid) {
        VdbBytes bytes(m_file, grid.name);
        bytes.moveTo(grid.begin, "the grid");
        skipGrid(bytes, grid);
        if (static_cast<std::int64_t>(bytes.at()) != grid.end)
            bytes.fail(fmt::format("that the grid ends at byte {}", grid.end), "that it ends here");
    };
    for (const VdbGrid& grid : candidates(name)) {
        check(grid);
        if (grid.parent.empty()) continue;
        const std::vector<VdbGrid> parents = candidates(grid.parent);
        if (parents.empty()
            || std::any_of(parents.begin(), parents.end(), [&](const VdbGrid& parent) {
                   return !parent.parent.empty() || parent.type != grid.type;
               }))
            throw fileError(m_file.path(), "grid '" + grid.name + "'",
                            "a grid '" + grid.parent + "' of the same type, whose tree it has",
                            "none");
        for (const VdbGrid& parent : parents) check(parent);
    }
}

} // namespace volcomp
