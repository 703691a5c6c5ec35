// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <fstream>
#include <optional>

#include <fmt/format.h>
#include <openvdb/io/File.h>
#include <openvdb/io/GridDescriptor.h>
#include <openvdb/io/io.h>
#include <openvdb/tree/LeafManager.h>
#include <tbb/parallel_reduce.h>

#include "volcomp/base/error.h"
#include "volcomp/base/text.h"
#include "volcomp/volume/vdb_io.h"
#include "volcomp/volume/vdb_format.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;
using openvdb::FloatGrid;
using openvdb::Vec3SGrid;

/// An open file.
class Reader {
public:
    Reader(const fs::path& file, bool delayed)
        : m_path(file), m_file(file.string()), m_delayed(delayed)
    {
        std::error_code code;
        if (!fs::exists(file, code))
            throw fileError(file, "", "a VDB file", "no file",
                            "Check the path; the bake and compose tools make such files.");
        if (!fs::is_regular_file(file, code))
            throw fileError(file, "", "a VDB file", "a directory or device");
        if (fs::file_size(file, code) == 0)
            throw fileError(file, "", "a VDB file", "an empty file");
        guarded([&] {
            m_delayed = reachesItsEnd() && m_delayed;
            // The file is read from where it is, not copied first; if it is replaced meanwhile, the
            // old one stays open.
            m_file.setCopyMaxBytes(0);
            m_file.open(m_delayed);
        });
        for (auto name = m_file.beginName(); name != m_file.endName(); ++name)
            m_names.push_back(*name);
    }

    bool has(const std::string& name) const
    {
        return std::find(m_names.begin(), m_names.end(), name) != m_names.end();
    }
    const std::vector<std::string>& names() const { return m_names; }
    openvdb::MetaMap metadata()
    {
        openvdb::MetaMap result;
        guarded([&] { result = *m_file.getMetadata(); });
        return result;
    }

    std::string identifier() const
    {
        return m_file.getUniqueTag() + "-" + std::to_string(fs::file_size(m_path));
    }

    template <class Grid>
    typename Grid::Ptr read(const std::string& name)
    {
        openvdb::GridBase::Ptr grid;
        guarded([&] { grid = m_file.readGrid(name); });
        auto typed = openvdb::gridPtrCast<Grid>(grid);
        if (!typed)
            throw fileError(m_path, "grid '" + name + "'", "type " + Grid::gridType(),
                            "type " + grid->type());
        checkTransform(*grid, name);
        return typed;
    }

    const fs::path& path() const { return m_path; }
    bool delayed() const { return m_delayed; }

private:
    /// Calls f. OpenVDB's exceptions do not name the file; those that leave here do.
    template <class F>
    void guarded(F&& f)
    {
        try {
            f();
        } catch (const Error&) {
            throw;
        } catch (const std::bad_alloc&) {
            throw; // the file is not to blame
        } catch (const std::exception& e) {
            throw fileError(m_path, "", "a complete VDB file",
                            std::string("one that cannot be read (") + e.what() + ")",
                            "It may be truncated or of another format; make it again.");
        }
    }

    /// Throws if the file ends before its last grid does: OpenVDB takes what is missing for zeros,
    /// or for counts of any size. Returns false for a file that does not say where its grids end,
    /// as it is too old or of another format.
    bool reachesItsEnd() const
    {
        // Magic number, three versions, whether there are offsets, and the file's identifier.
        constexpr int kHeader = 8 + 4 + 4 + 4 + 1 + 36;
        std::ifstream stream(m_path, std::ios::binary);
        stream.exceptions(std::ios::failbit | std::ios::badbit | std::ios::eofbit);
        std::int64_t magic = 0;
        std::uint32_t versions[3] = {}; // of the format, of the library
        stream.read(reinterpret_cast<char*>(&magic), sizeof magic);
        stream.read(reinterpret_cast<char*>(versions), sizeof versions);
        if (magic != openvdb::OPENVDB_MAGIC
            || versions[0] < openvdb::OPENVDB_FILE_VERSION_NODE_MASK_COMPRESSION)
            return false;
        openvdb::io::setVersion(stream, {versions[1], versions[2]}, versions[0]);
        stream.seekg(kHeader);
        openvdb::MetaMap().readMeta(stream);
        std::int32_t grids = 0;
        stream.read(reinterpret_cast<char*>(&grids), sizeof grids);
        const auto size = static_cast<std::int64_t>(fs::file_size(m_path));
        for (int i = 0; i < grids; ++i) {
            openvdb::io::GridDescriptor grid;
            grid.read(stream);
            if (grid.getEndPos() > size)
                throw openvdb::IoError(
                    fmt::format("grid '{}' goes on beyond the end of the file", grid.gridName()));
            grid.seekToEnd(stream);
        }
        return true;
    }

    void checkTransform(const openvdb::GridBase& grid, const std::string& name) const
    {
        const auto& t = grid.transform();
        const std::string place = "grid '" + name + "'";
        if (!t.isLinear())
            throw fileError(m_path, place, "a linear transform", "a " + t.mapType(),
                            "Resample the grid to cubic voxels.");
        const openvdb::Mat4d m = t.baseMap()->getAffineMap()->getMat4();
        const double h = m(0, 0);
        double off = std::max(std::abs(m(1, 1) - h), std::abs(m(2, 2) - h));
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j)
                if (i != j) off = std::max(off, std::abs(m(i, j)));
        if (!(h > 0) || !std::isfinite(h) || off > 1e-6 * h)
            throw fileError(
                m_path, place, "cubic voxels along the axes (uniform scale and translation)",
                fmt::format(
                    "a transform with the rows [{:g}, {:g}, {:g}], [{:g}, {:g}, {:g}], [{:g}, {:g}, {:g}]",
                    m(0, 0), m(0, 1), m(0, 2), m(1, 0), m(1, 1), m(1, 2), m(2, 0), m(2, 1),
                    m(2, 2)),
                "Resample the grid to such voxels.");
    }

    fs::path m_path;
    openvdb::io::File m_file;
    bool m_delayed;
    std::vector<std::string> m_names;
};

void checkBackground(const Reader& reader, const FloatGrid& grid)
{
    if (grid.background() != 0)
        throw fileError(reader.path(), fmt::format("grid '{}', background", grid.getName()),
                        "0 (a fog volume)", fmt::format("{}", grid.background()),
                        "Convert level sets to fog volumes first.");
}

void checkDensity(const Reader& reader, const FloatGrid& grid)
{
    const auto bad = [](float v) { return !(v >= 0) || !std::isfinite(v); };
    const auto fail = [&](const openvdb::Coord& at, float value) {
        throw fileError(
            reader.path(),
            fmt::format("grid '{}', voxel ({}, {}, {})", grid.getName(), at.x(), at.y(), at.z()),
            "a finite density >= 0", fmt::format("{}", value));
    };
    const openvdb::tree::LeafManager<const openvdb::FloatTree> leaves(grid.tree());
    // The first leaf with a bad voxel in the order of the tree, for any number of threads.
    const std::size_t first = tbb::parallel_reduce(
        leaves.leafRange(), leaves.leafCount(),
        [&](const auto& range, std::size_t found) {
            for (auto leaf = range.begin(); leaf; ++leaf)
                for (auto v = leaf->cbeginValueOn(); v && leaf.pos() < found; ++v)
                    if (bad(*v)) found = leaf.pos();
            return found;
        },
        [](std::size_t a, std::size_t b) { return std::min(a, b); });
    if (first < leaves.leafCount())
        for (auto v = leaves.leaf(first).cbeginValueOn(); v; ++v)
            if (bad(*v)) fail(v.getCoord(), *v);
    auto tile = grid.cbeginValueOn();
    tile.setMaxDepth(FloatGrid::ValueOnCIter::LEAF_DEPTH - 1);
    for (; tile; ++tile)
        if (bad(*tile)) fail(tile.getCoord(), *tile);
}

/// Sets vectors that are not finite to 0. With `normalise`, which is for foreign files, it gives
/// the others unit length.
void clean(Vec3SGrid& grid, bool normalise)
{
    const auto fixed = [normalise](openvdb::Vec3s v) {
        const float length = v.length();
        if (!std::isfinite(length)) return openvdb::Vec3s(0);
        if (normalise) return length > 1e-6f ? v / length : openvdb::Vec3s(0);
        return v;
    };
    openvdb::tree::LeafManager<openvdb::Vec3STree> leaves(grid.tree());
    leaves.foreach ([&](auto& leaf, std::size_t) {
        for (auto v = leaf.beginValueOn(); v; ++v) v.setValue(fixed(*v));
    });
    auto tile = grid.beginValueOn();
    tile.setMaxDepth(Vec3SGrid::ValueOnIter::LEAF_DEPTH - 1);
    for (; tile; ++tile) tile.setValue(fixed(*tile));
}

template <class T>
std::optional<T> metadata(const openvdb::GridBase& grid, const char* key)
{
    const auto value = grid.getMetadata<openvdb::TypedMetadata<T>>(key);
    if (!value) return std::nullopt;
    return value->value();
}

Vec3SGrid::Ptr readVectors(Reader& reader, const std::string& name, const FloatGrid& density,
                           bool normalise)
{
    auto grid = reader.read<Vec3SGrid>(name);
    if (!(grid->transform() == density.transform()))
        throw fileError(reader.path(), "grid '" + name + "'",
                        "the transform of '" + density.getName() + "'", "another one");
    if (normalise || !reader.delayed()) clean(*grid, normalise);
    return grid;
}

/// A grid of one value in the density's voxels. With `delayed` the value is the background of a
/// grid without leaves.
Vec3SGrid::Ptr sharedVector(const FloatGrid& density, const openvdb::Vec3s& value, bool delayed)
{
    auto grid = Vec3SGrid::create(delayed ? value : openvdb::Vec3s(0));
    grid->setTransform(density.transform().copy());
    if (delayed) return grid;
    grid->tree().topologyUnion(density.tree());
    openvdb::tree::LeafManager<openvdb::Vec3STree> leaves(grid->tree());
    leaves.foreach ([&](auto& leaf, std::size_t) {
        for (auto v = leaf.beginValueOn(); v; ++v) v.setValue(value);
    });
    auto tile = grid->beginValueOn();
    tile.setMaxDepth(Vec3SGrid::ValueOnIter::LEAF_DEPTH - 1);
    for (; tile; ++tile) tile.setValue(value);
    return grid;
}

VolumePart readPart(Reader& reader, const std::string& suffix)
{
    VolumePart part;
    part.density = reader.read<FloatGrid>("density" + suffix);
    checkBackground(reader, *part.density);
    if (!reader.delayed()) checkDensity(reader, *part.density);
    part.material = metadata<std::string>(*part.density, kMaterial).value_or("");
    const auto kind = metadata<std::string>(*part.density, kKind);
    const bool ours = kind.has_value();
    const bool has_tangent = reader.has("tangentu" + suffix);
    if (ours) part.kind = *kind == "surface" ? MaterialKind::surface : MaterialKind::fibre;
    else part.kind = has_tangent ? MaterialKind::fibre : MaterialKind::surface;
    if (const std::string name = directionName(part.kind) + suffix; reader.has(name))
        part.direction = readVectors(reader, name, *part.density, !ours);
    else if (const auto shared = metadata<openvdb::Vec3s>(*part.density, kDirection))
        part.direction = sharedVector(*part.density, *shared, reader.delayed());
    if (ours && (reader.has("shown" + suffix) || metadata<openvdb::Vec3s>(*part.density, kShown)))
        throw fileError(reader.path(), "grid 'shown" + suffix + "'",
                        "grid 'scatter_ratio" + suffix + "'", "what volcomp 0.1.0 had in its place",
                        "Write the levels of the volume anew (volcomp-render --write-levels).");
    if (const std::string name = "scatter_ratio" + suffix; ours && reader.has(name))
        part.scatter_ratio = readVectors(reader, name, *part.density, false);
    else if (const auto scatter_ratio = metadata<openvdb::Vec3s>(*part.density, kScatterRatio))
        part.scatter_ratio = sharedVector(*part.density, *scatter_ratio, reader.delayed());
    for (const GridNames names : {GridNames::houdini, GridNames::blender})
        if (const std::string name = colourName(names) + suffix; !part.colour && reader.has(name))
            part.colour = readVectors(reader, name, *part.density, false);
    if (const auto colour = metadata<openvdb::Vec3s>(*part.density, kColour))
        part.uniform_colour = *colour;
    return part;
}

} // namespace

Volume readVolume(const fs::path& file, bool delayed)
{
    Reader reader(file, delayed);
    std::vector<std::string> suffixes;
    for (const std::string& name : reader.names())
        if (name.rfind("density_", 0) == 0) suffixes.push_back(name.substr(7));
    if (suffixes.empty()) {
        if (!reader.has("density")) {
            const std::string found = joined(reader.names());
            throw fileError(file, "", "a grid named 'density'",
                            found.empty() ? "no grids" : "grids " + found);
        }
        suffixes.push_back("");
    }
    Volume volume;
    for (const std::string& suffix : suffixes) volume.parts.push_back(readPart(reader, suffix));
    for (const VolumePart& part : volume.parts)
        if (!(part.density->transform() == volume.parts[0].density->transform()))
            throw fileError(file, "grid '" + part.density->getName() + "'",
                            "the transform of the other density grids", "another one");
    return volume;
}

openvdb::MetaMap readVolumeMetadata(const fs::path& file) { return Reader(file, true).metadata(); }

std::string volumeIdentifier(const fs::path& file) { return Reader(file, true).identifier(); }

} // namespace volcomp
