#include <atomic>
#include <optional>

#include <openvdb/io/File.h>
#include <openvdb/tools/Composite.h>
#include <openvdb/tree/LeafManager.h>

#include "atomic_file.h"
#include "error.h"
#include "vdb_io.h"
#include "vdb_names.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;
using openvdb::FloatGrid;
using openvdb::Vec3SGrid;

constexpr float kLargestHalf = 65504.0f;
constexpr float kSmallestNormalHalf = 6.104e-5f;

/// The value that all active voxels share, if they do.
std::optional<Vec3f> sharedValue(const Vec3SGrid& grid)
{
    auto it = grid.cbeginValueOn();
    if (!it) return std::nullopt;
    const openvdb::Vec3s first = *it;
    openvdb::tree::LeafManager<const openvdb::Vec3STree> leaves(grid.tree());
    std::atomic<bool> same{true};
    leaves.foreach([&](const auto& leaf, std::size_t) {
        if (!same) return;
        for (auto v = leaf.cbeginValueOn(); v; ++v)
            if (*v != first) {
                same = false;
                return;
            }
    });
    Vec3SGrid::ValueOnCIter tile = grid.cbeginValueOn();
    tile.setMaxDepth(Vec3SGrid::ValueOnCIter::LEAF_DEPTH - 1);
    for (; tile && same; ++tile)
        if (*tile != first) same = false;
    if (!same) return std::nullopt;
    return first;
}

/// True where half floats hold every density to 2^-11 of it.
bool fitsHalf(const FloatGrid& grid)
{
    for (auto it = grid.cbeginValueOn(); it; ++it)
        if (*it > kLargestHalf || (*it > 0 && *it < kSmallestNormalHalf)) return false;
    return true;
}

void prepare(openvdb::GridBase& grid, const std::string& name, openvdb::VecType type)
{
    grid.setName(name);
    grid.setCreator("volcomp");
    grid.setGridClass(openvdb::GRID_FOG_VOLUME);
    grid.setVectorType(type);
    grid.setIsInWorldSpace(false);
}

/// A copy that shares the tree, so that names and metadata of the caller's grid stay as they were.
template <class Grid>
typename Grid::Ptr sharedCopy(const Grid& grid)
{
    return openvdb::ConstPtrCast<Grid>(grid.copy());
}

void addVectorGrid(openvdb::GridPtrVec& grids, FloatGrid& density, const Vec3SGrid::Ptr& source, const std::string& name,
                   const char* shared_key, openvdb::VecType type)
{
    if (!source) return;
    if (const auto value = sharedValue(*source)) {
        density.insertMeta(shared_key, openvdb::Vec3SMetadata(*value));
        return;
    }
    if (source->empty()) return;
    auto grid = sharedCopy(*source);
    prepare(*grid, name, type);
    grid->setSaveFloatAsHalf(true);
    grids.push_back(grid);
}

openvdb::GridPtrVec gridsOf(const Volume& volume)
{
    openvdb::GridPtrVec grids;
    const bool several = volume.parts.size() > 1;
    if (several) {
        auto sum = volume.parts[0].density->deepCopy();
        for (std::size_t i = 1; i < volume.parts.size(); ++i) {
            auto part = volume.parts[i].density->deepCopy();
            openvdb::tools::compSum(*sum, *part);
        }
        sum->clearMetadata();
        prepare(*sum, "density", openvdb::VEC_INVARIANT);
        sum->setSaveFloatAsHalf(fitsHalf(*sum));
        grids.push_back(sum);
    }
    for (const VolumePart& part : volume.parts) {
        const std::string suffix = several ? "_" + part.material : "";
        auto density = sharedCopy(*part.density);
        prepare(*density, "density" + suffix, openvdb::VEC_INVARIANT);
        density->setSaveFloatAsHalf(fitsHalf(*density));
        density->insertMeta(kMaterial, openvdb::StringMetadata(part.material));
        density->insertMeta(kKind, openvdb::StringMetadata(part.kind == MaterialKind::fibre ? "fibre" : "surface"));
        if (!part.colour) density->insertMeta(kColour, openvdb::Vec3SMetadata(part.uniform_colour));
        grids.push_back(density);
        addVectorGrid(grids, *density, part.direction, directionName(part.kind) + suffix, kDirection,
                      part.kind == MaterialKind::fibre ? openvdb::VEC_CONTRAVARIANT_RELATIVE : openvdb::VEC_COVARIANT_NORMALIZE);
        addVectorGrid(grids, *density, part.colour, "Cd" + suffix, kColour, openvdb::VEC_INVARIANT);
    }
    return grids;
}

} // namespace

void writeVolume(const fs::path& file, const Volume& volume, const openvdb::MetaMap& extra)
{
    if (volume.parts.empty()) throw fileError(file, "", "a volume with at least one material to write", "none");
    const openvdb::GridPtrVec grids = gridsOf(volume);
    openvdb::MetaMap meta(extra);
    meta.insertMeta("creator", openvdb::StringMetadata("volcomp"));
    writeAtomically(file, [&](const fs::path& temporary) {
        try {
            openvdb::io::File out(temporary.string());
            const bool blosc = openvdb::io::Archive::hasBloscCompression();
            out.setCompression((blosc ? openvdb::io::COMPRESS_BLOSC : openvdb::io::COMPRESS_ZIP) | openvdb::io::COMPRESS_ACTIVE_MASK);
            out.write(grids, meta);
            out.close();
        } catch (const std::exception& e) {
            throw fileError(file, "", "a file that can be written", e.what(), "Is the disk full, or the directory not yours?");
        }
    });
}

} // namespace volcomp
