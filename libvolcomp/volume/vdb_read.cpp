// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>
#include <openvdb/tree/LeafManager.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include "volcomp/base/error.h"
#include "volcomp/base/text.h"
#include "volcomp/volume/cubic_voxels.h"
#include "volcomp/volume/vdb_file.h"
#include "volcomp/volume/vdb_format.h"
#include "volcomp/volume/vdb_io.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;
using openvdb::FloatGrid;
using openvdb::Vec3SGrid;

void checkBackground(const VdbFile& file, const FloatGrid& grid)
{
    if (grid.background() != 0)
        throw fileError(file.path(), fmt::format("grid '{}', background", grid.getName()),
                        "0 (a fog volume)", fmt::format("{:g}", grid.background()),
                        "Convert level sets to fog volumes first.");
}

/// The largest and the least density, and the place of the least; of the first that is not finite,
/// if there is one.
struct Extremes {
    float largest = 0, least = 0;
    openvdb::Coord at;

    void add(float value, const openvdb::Coord& place)
    {
        if (!std::isfinite(least)) return;
        largest = std::max(largest, std::isfinite(value) ? value : 0);
        if (value >= least && std::isfinite(value)) return;
        least = value;
        at = place;
    }
    void add(const Extremes& other)
    {
        largest = std::max(largest, other.largest);
        if (std::isfinite(least) && !(other.least >= least)) {
            least = other.least;
            at = other.at;
        }
    }
};

/// The same for any number of threads.
Extremes extremesOf(const FloatGrid& grid)
{
    const openvdb::tree::LeafManager<const openvdb::FloatTree> leaves(grid.tree());
    Extremes found = tbb::parallel_deterministic_reduce(
        tbb::blocked_range<std::size_t>(0, leaves.leafCount(), 256), Extremes(),
        [&](const tbb::blocked_range<std::size_t>& range, Extremes e) {
            for (std::size_t i = range.begin(); i < range.end(); ++i)
                for (auto v = leaves.leaf(i).cbeginValueOn(); v; ++v) e.add(*v, v.getCoord());
            return e;
        },
        [](Extremes a, const Extremes& b) {
            a.add(b);
            return a;
        });
    auto tile = grid.cbeginValueOn();
    tile.setMaxDepth(FloatGrid::ValueOnCIter::LEAF_DEPTH - 1);
    for (; tile; ++tile) found.add(*tile, tile.getCoord());
    return found;
}

/// Sets all active values to what `fixed` makes of them.
template <class Grid, class F>
void change(Grid& grid, const F& fixed)
{
    openvdb::tree::LeafManager<typename Grid::TreeType> leaves(grid.tree());
    leaves.foreach ([&](auto& leaf, std::size_t) {
        for (auto v = leaf.beginValueOn(); v; ++v) v.setValue(fixed(*v));
    });
    auto tile = grid.beginValueOn();
    tile.setMaxDepth(Grid::ValueOnIter::LEAF_DEPTH - 1);
    for (; tile; ++tile) tile.setValue(fixed(*tile));
}

/// Throws if a density is not finite or negative. Sets tiny negative ones to 0, and adds a warning.
void checkDensity(const VdbFile& file, FloatGrid& grid, std::vector<std::string>& warnings)
{
    const Extremes e = extremesOf(grid);
    if (!std::isfinite(e.least) || !(e.least >= -kTinyNegative * e.largest))
        throw fileError(file.path(),
                        fmt::format("grid '{}', voxel ({}, {}, {})", grid.getName(), e.at.x(),
                                    e.at.y(), e.at.z()),
                        "a finite density >= 0", fmt::format("{:g}", e.least));
    if (e.least >= 0) return;
    change(grid, [](float v) { return v < 0 ? 0 : v; });
    warnings.push_back(file.path().string() + ": " + negativeDensities(grid.getName(), e.least));
}

/// A share from a file: 0 if it is not finite, and from 0 to 1.
float cleanShare(float v) { return std::isfinite(v) ? std::min(1.0f, std::max(0.0f, v)) : 0.0f; }

/// Sets vectors that are not finite to 0. With `normalise`, which is for foreign files, it gives
/// the others unit length.
void clean(Vec3SGrid& grid, bool normalise)
{
    change(grid, [normalise](openvdb::Vec3s v) {
        const float length = v.length();
        if (!std::isfinite(length)) return openvdb::Vec3s(0);
        if (normalise) return length > 1e-6f ? v / length : openvdb::Vec3s(0);
        return v;
    });
}

template <class T>
std::optional<T> metadata(const openvdb::GridBase& grid, const char* key)
{
    const auto value = grid.getMetadata<openvdb::TypedMetadata<T>>(key);
    if (!value) return std::nullopt;
    return value->value();
}

/// Reads the parts of a volume from a file.
class PartReader {
public:
    PartReader(VdbFile& file, LeavesRead leaves, std::vector<std::string>& warnings)
        : m_file(file), m_leaves(leaves), m_warnings(warnings)
    {
    }

    /// The part whose density has this name; its other grids end as that name does.
    VolumePart read(const std::string& name);

private:
    bool now() const { return m_leaves == LeavesRead::now; }
    /// A grid of the density's transform.
    template <class Grid>
    typename Grid::Ptr readBeside(const std::string& name, const FloatGrid& density,
                                  LeavesRead leaves);
    Vec3SGrid::Ptr readVectors(const std::string& name, const FloatGrid& density, bool normalise);
    FloatGrid::Ptr readOwnShare(const std::string& name, const FloatGrid& density);
    template <class Grid>
    typename Grid::Ptr sharedValue(const FloatGrid& density,
                                   const typename Grid::ValueType& value) const;
    /// One vector of the density's metadata; none if it is not finite.
    std::optional<openvdb::Vec3s> metadataVector(const FloatGrid& density, const char* key) const;
    MaterialKind kindOf(const FloatGrid& density, bool has_tangent) const;

    VdbFile& m_file;
    LeavesRead m_leaves;
    std::vector<std::string>& m_warnings;
};

template <class Grid>
typename Grid::Ptr PartReader::readBeside(const std::string& name, const FloatGrid& density,
                                          LeavesRead leaves)
{
    auto grid = m_file.read<Grid>(name, leaves);
    if (!(grid->transform() == density.transform()))
        throw fileError(m_file.path(), "grid '" + name + "'",
                        "the transform of '" + density.getName() + "'", "another one");
    return grid;
}

Vec3SGrid::Ptr PartReader::readVectors(const std::string& name, const FloatGrid& density,
                                       bool normalise)
{
    auto grid = readBeside<Vec3SGrid>(name, density, normalise ? LeavesRead::now : m_leaves);
    if (normalise || now()) clean(*grid, normalise);
    return grid;
}

FloatGrid::Ptr PartReader::readOwnShare(const std::string& name, const FloatGrid& density)
{
    auto grid = readBeside<FloatGrid>(name, density, m_leaves);
    if (now()) change(*grid, cleanShare);
    return grid;
}

/// A grid of one value in the density's voxels. If leaves are read later, the value is the
/// background of a grid without leaves.
template <class Grid>
typename Grid::Ptr PartReader::sharedValue(const FloatGrid& density,
                                           const typename Grid::ValueType& value) const
{
    auto grid = Grid::create(now() ? openvdb::zeroVal<typename Grid::ValueType>() : value);
    grid->setTransform(density.transform().copy());
    if (!now()) return grid;
    grid->tree().topologyUnion(density.tree());
    change(*grid, [&](const auto&) { return value; });
    return grid;
}

std::optional<openvdb::Vec3s> PartReader::metadataVector(const FloatGrid& density,
                                                         const char* key) const
{
    const auto value = metadata<openvdb::Vec3s>(density, key);
    if (value && !std::isfinite(value->length()))
        throw fileError(
            m_file.path(), fmt::format("grid '{}', metadata '{}'", density.getName(), key),
            "finite numbers", fmt::format("{:g} {:g} {:g}", (*value)[0], (*value)[1], (*value)[2]));
    return value;
}

MaterialKind PartReader::kindOf(const FloatGrid& density, bool has_tangent) const
{
    const auto kind = metadata<std::string>(density, kKind);
    if (!kind) return has_tangent ? MaterialKind::fibre : MaterialKind::surface;
    if (*kind == "fibre") return MaterialKind::fibre;
    if (*kind == "surface") return MaterialKind::surface;
    throw fileError(m_file.path(),
                    fmt::format("grid '{}', metadata '{}'", density.getName(), kKind),
                    "'fibre' or 'surface'", "'" + *kind + "'");
}

VolumePart PartReader::read(const std::string& name)
{
    const std::string suffix = name.rfind(kDensity, 0) == 0 ? name.substr(kDensity.size()) : "";
    VolumePart part;
    part.density = m_file.read<FloatGrid>(name, m_leaves);
    checkBackground(m_file, *part.density);
    if (now()) checkDensity(m_file, *part.density, m_warnings);
    part.material = metadata<std::string>(*part.density, kMaterial).value_or("");
    const bool ours = metadata<std::string>(*part.density, kKind).has_value();
    part.kind = kindOf(*part.density, m_file.has("tangentu" + suffix));
    if (const std::string grid = directionName(part.kind) + suffix; m_file.has(grid))
        part.direction = readVectors(grid, *part.density, !ours);
    else if (const auto shared = metadataVector(*part.density, kDirection))
        part.direction = sharedValue<Vec3SGrid>(*part.density, *shared);
    if (ours && (m_file.has("shown" + suffix) || metadata<openvdb::Vec3s>(*part.density, kShown)))
        throw fileError(
            m_file.path(), "grid 'shown" + suffix + "'", "grid 'scatter_ratio" + suffix + "'",
            "what volcomp 0.1.0 had in its place",
            "Files of levels are not written any more: render the volume that they were of.");
    if (const std::string grid = "scatter_ratio" + suffix; ours && m_file.has(grid))
        part.scatter_ratio = readVectors(grid, *part.density, false);
    else if (const auto scatter_ratio = metadataVector(*part.density, kScatterRatio))
        part.scatter_ratio = sharedValue<Vec3SGrid>(*part.density, *scatter_ratio);
    if (const std::string grid = "own_share" + suffix; ours && m_file.has(grid))
        part.own_share = readOwnShare(grid, *part.density);
    else if (const auto share = metadata<float>(*part.density, kOwnShare))
        part.own_share = sharedValue<FloatGrid>(*part.density, cleanShare(*share));
    for (const GridNames names : {GridNames::houdini, GridNames::blender})
        if (const std::string grid = colourName(names) + suffix; !part.colour && m_file.has(grid))
            part.colour = readVectors(grid, *part.density, false);
    if (const auto colour = metadataVector(*part.density, kColour)) part.uniform_colour = *colour;
    return part;
}

bool isFloat(const VdbGrid& grid) { return grid.type == FloatGrid::gridType(); }

/// The names of a file's float grids, for messages.
std::string floatGrids(const VdbFile& file)
{
    std::vector<std::string> names;
    for (const VdbGrid& grid : file.grids())
        if (isFloat(grid)) names.push_back(grid.name);
    return joined(names);
}

/// The densities of the file's parts. Other programs' files may have `density_old` beside
/// `density`: `density` is the sum of the others only if these say that they are our parts.
std::vector<std::string> densitiesOf(VdbFile& file, std::vector<std::string>& warnings)
{
    std::vector<std::string> ours, others;
    for (const VdbGrid& grid : file.grids()) {
        if (grid.name.rfind(kDensity + "_", 0) != 0) continue;
        const bool is_ours =
            isFloat(grid) && metadata<std::string>(*file.readHead(grid.name), kKind).has_value();
        (is_ours ? ours : others).push_back(grid.name);
    }
    if (ours.empty() && !file.has(kDensity)) std::swap(ours, others);
    if (ours.empty() && file.has(kDensity)) ours.push_back(kDensity);
    if (!others.empty())
        warnings.push_back(
            fmt::format("{}: grids {} are not read, only {}; the option --grid reads "
                        "another one",
                        file.path().string(), joined(others), joined(ours)));
    if (!ours.empty()) return ours;
    std::vector<std::string> names;
    for (const VdbGrid& grid : file.grids()) names.push_back(grid.name);
    const std::string found = joined(names), floats = floatGrids(file);
    throw fileError(
        file.path(), "", "a grid named 'density'", found.empty() ? "no grids" : "grids " + found,
        floats.empty()
            ? ""
            : "The option --grid NAME takes any of these as the density: " + floats + ".");
}

/// The volume in cubic voxels, if its own are no cubes along the axes.
Volume cubic(Volume volume, const VdbFile& file)
{
    if (hasCubicVoxels(volume.parts[0].density->transform())) return volume;
    try {
        volume = withCubicVoxels(volume);
    } catch (const Error& e) {
        throw Error(file.path().string() + ": " + e.what());
    }
    double voxels = 0, bytes = 0;
    for (const VolumePart& part : volume.parts) {
        voxels += double(part.density->activeVoxelCount());
        for (const openvdb::GridBase::Ptr& grid :
             {openvdb::GridBase::Ptr(part.density), openvdb::GridBase::Ptr(part.direction),
              openvdb::GridBase::Ptr(part.colour), openvdb::GridBase::Ptr(part.scatter_ratio),
              openvdb::GridBase::Ptr(part.own_share)})
            if (grid) bytes += double(grid->baseTree().memUsage());
    }
    volume.warnings.push_back(
        fmt::format("{}: its voxels are no cubes along the axes and were resampled to {:.0f} cubes "
                    "of edge {:g}, which takes {:.0f} MB more than to read it",
                    file.path().string(), voxels, volume.voxelSize(), bytes / 1e6));
    return volume;
}

} // namespace

Volume readVolume(const fs::path& path, bool delayed, const std::string& grid)
{
    VdbFile file(path);
    Volume volume;
    std::vector<std::string> names{grid};
    if (grid.empty()) names = densitiesOf(file, volume.warnings);
    else if (!file.has(grid))
        throw fileError(path, "", "a grid named '" + grid + "'", "grids " + floatGrids(file));
    const openvdb::GridBase::Ptr first = file.readHead(names[0]);
    const bool later = delayed && hasCubicVoxels(first->transform());
    PartReader reader(file, later ? LeavesRead::when_touched : LeavesRead::now, volume.warnings);
    for (const std::string& name : names) volume.parts.push_back(reader.read(name));
    for (const VolumePart& part : volume.parts)
        if (!(part.density->transform() == volume.parts[0].density->transform()))
            throw fileError(path, "grid '" + part.density->getName() + "'",
                            "the transform of the other density grids", "another one");
    return cubic(std::move(volume), file);
}

openvdb::MetaMap readVolumeMetadata(const fs::path& file) { return VdbFile(file).metadata(); }

std::string volumeIdentifier(const fs::path& file, const std::string& grid)
{
    return VdbFile(file).identifier() + (grid.empty() ? "" : "-" + grid);
}

} // namespace volcomp
