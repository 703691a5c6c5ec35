// SPDX-License-Identifier: Apache-2.0
// Where the renderer takes its voxels from: a volume in memory, a file, or a packed volume.
//
// Space is cut as an OpenVDB tree cuts it (node_index.h): into nodes of 128^3 voxels, and each node
// into 16^3 blocks of 8^3 voxels, which are the tree's leaves. A source first says which nodes and
// blocks may hold particles, which needs none of their values, and then gives the values of each
// block when it is asked for them. So a reader decides on its memory before the first value is
// read, and a source that reads or makes its values on demand never holds more than a few blocks of
// them.
//
// Every function may be called from several threads at once.
#pragma once

#include <array>
#include <bitset>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "volcomp/base/node_index.h"
#include "volcomp/volume/volume.h"

namespace volcomp {

/// One bit for each voxel of a block, as in a PackedBlock: bit 8 y + z of word x. So the voxel of
/// numberInLeaf() n has bit n & 63 of word n >> 6.
using VoxelMask = std::array<std::uint64_t, 8>;

/// One material of a source.
struct PartInfo {
    std::string material; ///< empty if a foreign file names none
    MaterialKind kind = MaterialKind::fibre;
    std::string grid; ///< name of its density, for messages
    bool has_direction = false, has_colour = false, has_scatter_ratio = false;
    Vec3f uniform_colour{1.0f}; ///< of all voxels, if has_colour is false
};

/// Which blocks of a node may hold particles, by numberInNode().
struct NodeBlocks {
    std::bitset<kNodeSize> voxels; ///< blocks whose voxels have values of their own
    std::bitset<kNodeSize> tiles;  ///< blocks in which all voxels have the same values
    bool one_tile = false;         ///< all blocks are tiles, and their values are the same
};

/// The particles of one part in one block. Each list has a value for each voxel of the mask, in the
/// order of its bits, or a single value that holds for all of them.
struct PartVoxels {
    VoxelMask mask{};                 ///< the voxels whose density is not 0; NaN is not 0
    std::vector<float> density;       ///< 1 / world length; as the source has it, not checked
    std::vector<Vec3f> direction;     ///< as VolumePart::direction; empty: no direction
    std::vector<Vec3f> colour;        ///< never empty, unless the mask is
    std::vector<Vec3f> scatter_ratio; ///< as VolumePart::scatter_ratio; empty: 1 everywhere
    std::vector<float> own_share;     ///< as VolumePart::own_share; empty: 0 everywhere

    /// The value of the k-th voxel of the mask, or `otherwise` if the list is empty.
    template <class T>
    static T at(const std::vector<T>& list, std::size_t k, const T& otherwise)
    {
        return list.empty() ? otherwise : list[list.size() == 1 ? 0 : k];
    }
    void clear();
};
/// A block's particles, by part.
using BlockVoxels = std::vector<PartVoxels>;

/// What voxels are taken from.
class BlockSource {
public:
    virtual ~BlockSource() = default;

    const std::vector<PartInfo>& parts() const { return m_parts; } ///< at least one
    const std::string& file() const { return m_file; }             ///< for messages; empty: no file
    /// Volume::warnings.
    const std::vector<std::string>& warnings() const { return m_warnings; }
    /// Index space to world; the same for all parts. Linear, or the constructor of the source or of
    /// the reader throws.
    const openvdb::math::Transform& transform() const { return *m_transform; }

    /// Lowest voxels of the nodes that may hold particles, in the order of x, y and z, each once.
    virtual std::vector<openvdb::Coord> nodes() const = 0;
    /// The blocks of a node. A source that does not know yet may name blocks that turn out empty.
    virtual NodeBlocks blocks(const openvdb::Coord& node) const = 0;
    /// The voxels of a block that may have a density other than 0 in a part. This needs no values;
    /// a source that does not know yet answers with all.
    virtual VoxelMask mayHold(const openvdb::Coord& block, std::size_t part) const = 0;
    /// Brings the particles of a block, all parts in their order; `voxels` is overwritten, and its
    /// memory used again. A block of `NodeBlocks::voxels` may be taken once, as the source may free
    /// what it holds of it; a tile any number of times.
    virtual void take(const openvdb::Coord& block, BlockVoxels& voxels) const = 0;

protected:
    BlockSource(std::vector<PartInfo> parts, openvdb::math::Transform::ConstPtr transform,
                std::vector<std::string> warnings = {}, std::string file = {})
        : m_parts(std::move(parts)), m_transform(std::move(transform)),
          m_warnings(std::move(warnings)), m_file(std::move(file))
    {
    }
    BlockSource(const BlockSource&) = default;
    BlockSource(BlockSource&&) = default;
    BlockSource& operator=(const BlockSource&) = delete;
    BlockSource& operator=(BlockSource&&) = delete;

private:
    std::vector<PartInfo> m_parts;
    openvdb::math::Transform::ConstPtr m_transform;
    std::vector<std::string> m_warnings;
    std::string m_file;
};

/// What becomes of a block's values in the grids when they have been taken.
enum class TakenBlocks {
    stay,
    freed ///< whoever else holds the grids; their topology stays
};

/// The blocks of a Volume, whose grids it shares. With grids that read their leaves from a file
/// when they are first touched (readVolume(), delayed) and TakenBlocks::freed, only the topology
/// and the blocks at hand are in memory.
class VolumeSource : public BlockSource {
public:
    /// Throws Error if the volume has no parts or the grids' transforms differ. `file` is for
    /// messages.
    explicit VolumeSource(Volume volume, TakenBlocks taken = TakenBlocks::stay,
                          std::string file = {});

    std::vector<openvdb::Coord> nodes() const override;
    NodeBlocks blocks(const openvdb::Coord& node) const override;
    VoxelMask mayHold(const openvdb::Coord& block, std::size_t part) const override;
    void take(const openvdb::Coord& block, BlockVoxels& voxels) const override;

private:
    Volume m_volume;
    TakenBlocks m_taken;
};

struct PackedBlock;
struct PackedPart;
struct PackedVolume;

/// What a source says of a packed part.
PartInfo infoOf(const PackedPart& part);
/// Adds the particles of one of the part's blocks to what is empty.
void takeBlock(const PackedPart& part, const PackedBlock& block, PartVoxels& voxels);

/// The blocks of a packed volume, which must outlive this and stays as it is.
class PackedSource : public BlockSource {
public:
    /// Throws Error if the volume has no parts.
    explicit PackedSource(const PackedVolume& volume);

    std::vector<openvdb::Coord> nodes() const override;
    NodeBlocks blocks(const openvdb::Coord& node) const override;
    VoxelMask mayHold(const openvdb::Coord& block, std::size_t part) const override;
    void take(const openvdb::Coord& block, BlockVoxels& voxels) const override;

private:
    const PackedVolume& m_volume;
};

} // namespace volcomp
