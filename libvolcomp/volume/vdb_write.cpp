// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <atomic>
#include <optional>
#include <sstream>

#include <fmt/format.h>
#include <openvdb/io/Archive.h>
#include <openvdb/io/GridDescriptor.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>

#include "volcomp/base/atomic_file.h"
#include "volcomp/base/error.h"
#include "volcomp/volume/vdb_io.h"
#include "volcomp/volume/hashed_file.h"
#include "volcomp/volume/vdb_format.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;
using openvdb::FloatGrid;
using openvdb::Vec3SGrid;
using openvdb::math::half;

constexpr float kLargestHalf = 65504.0f;
constexpr float kSmallestNormalHalf = 6.104e-5f;

/// Writes a grid without expanding its leaves in memory: its tree is made for the topology and has
/// no values, and the values are written from packed ones, many leaves at a time. `Packed` is the
/// value as the part keeps it.
template <class Grid, class Packed>
class PackedGrid : public Grid {
public:
    using Values = Packed* (PackedPart::*)(const PackedBlock&) const;

    PackedGrid(const PackedPart& part, Values values) : m_part(part), m_values(values) { }

    // The statistics that OpenVDB writes among the metadata.
    openvdb::Index64 activeVoxelCount() const override { return m_part.voxels(); }
    openvdb::Index64 memUsage() const override
    {
        return m_part.blocks.size()
            * (sizeof(typename Grid::TreeType::LeafNodeType)
               + 512 * sizeof(typename Grid::ValueType));
    }
    openvdb::CoordBBox evalActiveVoxelBoundingBox() const override
    {
        openvdb::CoordBBox box;
        for (const PackedBlock& b : m_part.blocks)
            for (int x = 0; x < 8; ++x)
                if (std::uint64_t rows = b.mask[x]) {
                    const int first_y = __builtin_ctzll(rows) >> 3,
                              last_y = 7 - (__builtin_clzll(rows) >> 3);
                    for (int shift = 32; shift >= 8; shift /= 2) rows |= rows >> shift;
                    const auto columns = static_cast<unsigned>(rows & 0xff);
                    box.expand(openvdb::CoordBBox(
                        b.origin.offsetBy(x, first_y, __builtin_ctz(columns)),
                        b.origin.offsetBy(x, last_y, 31 - __builtin_clz(columns))));
                }
        return box;
    }

    void writeTopology(std::ostream& out) const override
    {
        using Leaf = typename Grid::TreeType::LeafNodeType;
        typename Grid::TreeType tree{this->background()};
        openvdb::tree::ValueAccessor<typename Grid::TreeType> accessor(tree);
        for (const PackedBlock& b : m_part.blocks) {
            auto leaf =
                std::make_unique<Leaf>(openvdb::PartialCreate(), b.origin, this->background());
            typename Leaf::NodeMaskType mask;
            for (openvdb::Index x = 0; x < 8; ++x)
                mask.template getWord<std::uint64_t>(x) = b.mask[x];
            leaf->setValueMask(mask);
            accessor.addLeaf(leaf.release());
        }
        tree.writeTopology(out, this->saveFloatAsHalf());
    }

    /// Writes the bytes that LeafNode::writeBuffers() would write, one leaf after another.
    void writeBuffers(std::ostream& out) const override
    {
        constexpr std::size_t kLeaves = 512; // in a task
        const std::uint32_t compression = openvdb::io::getDataCompression(out);
        std::size_t next = 0;
        const auto tokens = 4 * static_cast<std::size_t>(tbb::this_task_arena::max_concurrency());
        tbb::parallel_pipeline(
            tokens,
            tbb::make_filter<void, std::size_t>(tbb::filter_mode::serial_in_order,
                                                [&](tbb::flow_control& control) {
                                                    const std::size_t first = next;
                                                    if (first >= m_part.blocks.size())
                                                        control.stop();
                                                    next += kLeaves;
                                                    return first;
                                                })
                & tbb::make_filter<std::size_t, std::string>(
                    tbb::filter_mode::parallel,
                    [&](std::size_t first) {
                        std::ostringstream bytes;
                        const std::size_t end = std::min(first + kLeaves, m_part.blocks.size());
                        for (std::size_t i = first; i < end; ++i)
                            writeLeaf(m_part.blocks[i], compression, bytes);
                        return bytes.str();
                    })
                & tbb::make_filter<std::string, void>(
                    tbb::filter_mode::serial_in_order, [&](const std::string& bytes) {
                        out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
                    }));
    }

private:
    void writeLeaf(const PackedBlock& block, std::uint32_t compression, std::ostream& out) const
    {
        out.write(reinterpret_cast<const char*>(block.mask.data()), sizeof(block.mask));
        out.put(openvdb::io::NO_MASK_OR_INACTIVE_VALS); // inactive values are the background
        const Packed* values = (m_part.*m_values)(block);
        if constexpr (std::is_same_v<Packed, float>) {
            if (this->saveFloatAsHalf()) {
                half halves[512];
                toHalf(values, halves, block.count);
                openvdb::io::writeData(out, halves, block.count, compression);
                return;
            }
        }
        openvdb::io::writeData(out, values, block.count, compression);
    }

    const PackedPart& m_part;
    Values m_values;
};

using PackedFloats = PackedGrid<FloatGrid, float>;
using PackedVectors = PackedGrid<Vec3SGrid, Half3>;
using PackedHalves = PackedGrid<FloatGrid, half>; ///< is saved as halves

/// The value that all voxels have, if it is the same.
template <class Packed>
std::optional<Packed> sharedValue(const PackedPart& part,
                                  Packed* (PackedPart::*values)(const PackedBlock&) const)
{
    if (part.blocks.empty()) return std::nullopt;
    const Packed first = *(part.*values)(part.blocks[0]);
    std::atomic<bool> same{true};
    tbb::parallel_for(std::size_t(0), part.blocks.size(), [&](std::size_t i) {
        const Packed* v = (part.*values)(part.blocks[i]);
        if (same && !std::all_of(v, v + part.blocks[i].count, [&](const Packed& p) {
                return p == first;
            }))
            same = false;
    });
    if (!same) return std::nullopt;
    return first;
}

/// True if half floats hold every density to 2^-11 of it.
bool fitsHalf(const PackedPart& part)
{
    return std::all_of(part.blocks.begin(), part.blocks.end(), [&](const PackedBlock& b) {
        return std::all_of(part.density(b), part.density(b) + b.count, [](float v) {
            return v <= kLargestHalf && (v <= 0 || v >= kSmallestNormalHalf);
        });
    });
}

/// A part whose density is the sum of the parts' densities.
PackedPart sumOf(const std::vector<PackedPart>& parts)
{
    PackedPart sum;
    VoxelStore& store = sum.stores.emplace_back();
    struct Source {
        const PackedPart* part;
        const PackedBlock* block;
    };
    std::vector<Source> sources;
    for (const PackedPart& part : parts)
        for (const PackedBlock& b : part.blocks) sources.push_back({&part, &b});
    std::stable_sort(sources.begin(), sources.end(), [](const Source& a, const Source& b) {
        return inTreeOrder(a.block->origin, b.block->origin);
    });
    for (std::size_t i = 0; i < sources.size();) {
        PackedBlock block = *sources[i].block;
        float dense[512] = {};
        for (; i < sources.size() && sources[i].block->origin == block.origin; ++i) {
            const PackedBlock& from = *sources[i].block;
            const float* value = sources[i].part->density(from);
            for (int x = 0; x < 8; ++x) {
                block.mask[x] |= from.mask[x];
                for (std::uint64_t left = from.mask[x]; left; left &= left - 1)
                    dense[64 * x + __builtin_ctzll(left)] += *value++;
            }
        }
        block.count = 0;
        for (const std::uint64_t word : block.mask)
            block.count += static_cast<std::uint32_t>(__builtin_popcountll(word));
        block.values = store.allocate(block.count * sizeof(float));
        float* value = sum.density(block);
        for (int x = 0; x < 8; ++x)
            for (std::uint64_t left = block.mask[x]; left; left &= left - 1)
                *value++ = dense[64 * x + __builtin_ctzll(left)];
        sum.blocks.push_back(block);
    }
    return sum;
}

void prepare(openvdb::GridBase& grid, const PackedVolume& volume, const std::string& name,
             openvdb::VecType type, bool as_half)
{
    grid.setTransform(volume.transform->copy());
    grid.setName(name);
    grid.setCreator("volcomp");
    grid.setGridClass(openvdb::GRID_FOG_VOLUME);
    grid.setVectorType(type);
    grid.setIsInWorldSpace(false);
    grid.setSaveFloatAsHalf(as_half);
}

/// Adds a vector grid, or metadata of the density if one value holds everywhere.
void addVectors(openvdb::GridPtrVec& grids, FloatGrid& density, const PackedVolume& volume,
                const PackedPart& part, PackedVectors::Values values, const std::string& name,
                const char* shared_key, openvdb::VecType type)
{
    if (part.blocks.empty()) return;
    if (const auto value = sharedValue(part, values)) {
        density.insertMeta(shared_key, openvdb::Vec3SMetadata(fromHalves(*value)));
        return;
    }
    const auto grid = std::make_shared<PackedVectors>(part, values);
    prepare(*grid, volume, name, type, true);
    grids.push_back(grid);
}

/// The same for the own shares.
void addOwnShare(openvdb::GridPtrVec& grids, FloatGrid& density, const PackedVolume& volume,
                 const PackedPart& part, const std::string& suffix)
{
    if (part.blocks.empty()) return;
    if (const auto value = sharedValue(part, &PackedPart::ownShare)) {
        density.insertMeta(kOwnShare, openvdb::FloatMetadata(*value));
        return;
    }
    const auto grid = std::make_shared<PackedHalves>(part, &PackedPart::ownShare);
    prepare(*grid, volume, "own_share" + suffix, openvdb::VEC_INVARIANT, true);
    grids.push_back(grid);
}

/// The grids of a volume's file. They refer to the volume and to `sum`, which becomes the sum of
/// the parts, until they are written.
openvdb::GridPtrVec gridsOf(const PackedVolume& volume, PackedPart& sum, GridNames names)
{
    openvdb::GridPtrVec grids;
    const bool several = volume.parts.size() > 1;
    if (several) {
        sum = sumOf(volume.parts);
        const auto grid = std::make_shared<PackedFloats>(sum, &PackedPart::density);
        prepare(*grid, volume, "density", openvdb::VEC_INVARIANT, fitsHalf(sum));
        grids.push_back(grid);
    }
    for (const PackedPart& part : volume.parts) {
        const std::string suffix = several ? "_" + part.material : "";
        const auto density = std::make_shared<PackedFloats>(part, &PackedPart::density);
        prepare(*density, volume, "density" + suffix, openvdb::VEC_INVARIANT, fitsHalf(part));
        density->insertMeta(kMaterial, openvdb::StringMetadata(part.material));
        density->insertMeta(
            kKind, openvdb::StringMetadata(part.kind == MaterialKind::fibre ? "fibre" : "surface"));
        if (!part.has_colour)
            density->insertMeta(kColour, openvdb::Vec3SMetadata(part.uniform_colour));
        grids.push_back(density);
        if (part.has_direction)
            addVectors(grids, *density, volume, part, &PackedPart::direction,
                       directionName(part.kind) + suffix, kDirection,
                       part.kind == MaterialKind::fibre ? openvdb::VEC_CONTRAVARIANT_RELATIVE
                                                        : openvdb::VEC_COVARIANT_NORMALIZE);
        if (part.has_colour)
            addVectors(grids, *density, volume, part, &PackedPart::colour,
                       colourName(names) + suffix, kColour, openvdb::VEC_INVARIANT);
        if (part.has_scatter_ratio)
            addVectors(grids, *density, volume, part, &PackedPart::scatterRatio,
                       "scatter_ratio" + suffix, kScatterRatio, openvdb::VEC_INVARIANT);
        if (part.has_own_share) addOwnShare(grids, *density, volume, part, suffix);
    }
    return grids;
}

constexpr std::streamoff kUuid = 36; ///< letters

/// As openvdb::io::Archive writes one: 8-4-4-4-12 hexadecimal digits.
std::string uuidOf(const std::array<std::uint64_t, 2>& hash)
{
    return fmt::format("{:08x}-{:04x}-{:04x}-{:04x}-{:012x}", hash[0] >> 32, hash[0] >> 16 & 0xffff,
                       hash[0] & 0xffff, hash[1] >> 48, hash[1] & 0xffffffffffff);
}

/// Writes what openvdb::io::File writes, but not the metadata "file_delayed_load", the sizes of all
/// leaves ahead of the leaves: for them OpenVDB compresses each leaf twice, and needs the leaves in
/// memory. Readers do without.
///
/// The file's UUID, which OpenVDB draws by chance, follows from all other bytes: a volume that is
/// made again has the same bytes.
class Writer : public openvdb::io::Archive {
public:
    explicit Writer(const fs::path& file) : m_buffer(file), m_out(&m_buffer) { }

    void writeGrids(const openvdb::GridPtrVec& grids, const openvdb::MetaMap& meta)
    {
        openvdb::io::setDataCompression(m_out, compression());
        writeHeader(m_out, true);
        const std::streamoff head = m_out.tellp();
        m_buffer.startHash();
        meta.writeMeta(m_out);
        const auto count = static_cast<std::int32_t>(grids.size());
        m_out.write(reinterpret_cast<const char*>(&count), sizeof(count));
        for (const openvdb::GridBase::Ptr& grid : grids) writeGrid(*grid);
        m_out.seekp(head - kUuid);
        m_out << uuidOf(m_buffer.hash());
        m_buffer.close();
        if (!m_out || !m_buffer.closed()) throw openvdb::IoError(openvdb::io::getErrorString());
    }

private:
    void writeGrid(openvdb::GridBase& grid)
    {
        openvdb::io::GridDescriptor descriptor(grid.getName(), grid.type(), grid.saveFloatAsHalf());
        descriptor.writeHeader(m_out);
        const auto positions = m_out.tellp();
        descriptor.writeStreamPos(m_out); // not known yet: written again below
        descriptor.setGridPos(m_out.tellp());
        setGridCompression(m_out, grid);
        grid.addStatsMetadata();
        grid.insertMeta(openvdb::GridBase::META_FILE_COMPRESSION,
                        openvdb::StringMetadata(openvdb::io::compressionToString(
                            openvdb::io::getDataCompression(m_out))));
        grid.writeMeta(m_out);
        grid.writeTransform(m_out);
        grid.writeTopology(m_out);
        descriptor.setBlockPos(m_out.tellp());
        grid.writeBuffers(m_out);
        descriptor.setEndPos(m_out.tellp());
        m_out.seekp(positions);
        descriptor.writeStreamPos(m_out);
        descriptor.seekToEnd(m_out);
    }

    HashedFile m_buffer;
    std::ostream m_out;
};

} // namespace

void writeVolume(const fs::path& file, const PackedVolume& volume, const openvdb::MetaMap& extra,
                 GridNames names)
{
    if (volume.parts.empty())
        throw fileError(file, "", "a volume with at least one material to write", "none");
    PackedPart sum;
    const openvdb::GridPtrVec grids = gridsOf(volume, sum, names);
    openvdb::MetaMap meta(extra);
    meta.insertMeta("creator", openvdb::StringMetadata("volcomp"));
    writeAtomically(file, [&](const fs::path& temporary) {
        try {
            Writer out(temporary);
            const bool blosc = openvdb::io::Archive::hasBloscCompression();
            out.setCompression((blosc ? openvdb::io::COMPRESS_BLOSC : openvdb::io::COMPRESS_ZIP)
                               | openvdb::io::COMPRESS_ACTIVE_MASK);
            out.writeGrids(grids, meta);
        } catch (const std::bad_alloc&) {
            throw; // the disk is not to blame
        } catch (const std::exception& e) {
            throw fileError(file, "", "a file that can be written", e.what(),
                            "Is the disk full, or the directory not yours?");
        }
    });
}

void writeVolume(const fs::path& file, const Volume& volume, const openvdb::MetaMap& extra,
                 GridNames names)
{
    if (volume.parts.empty())
        throw fileError(file, "", "a volume with at least one material to write", "none");
    writeVolume(file, pack(volume), extra, names);
}

} // namespace volcomp
