// A volume's active voxels alone, packed: what compose() makes and what files are written from.
//
// An OpenVDB leaf keeps 512 values however few are active, 28 bytes a slot for density, direction
// and colour. Composed fur fills a sixth of its leaves, so packed it takes a tenth of that memory,
// and memory is what composing spends its time on.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "volcomp/volume/half_floats.h"
#include "volcomp/volume/volume.h"

namespace volcomp {

/// Memory for voxels, given out from large chunks and freed all at once.
class VoxelStore {
public:
    /// Aligned to 8 bytes; not initialised.
    std::byte* allocate(std::size_t bytes);

    std::size_t bytes() const { return m_bytes; } ///< of all chunks

private:
    struct Free {
        void operator()(std::byte* p) const;
    };
    std::vector<std::unique_ptr<std::byte[], Free>> m_chunks;
    std::byte* m_next = nullptr;
    std::size_t m_left = 0, m_bytes = 0;
};

/// 8^3 voxels of which some are active: an OpenVDB leaf.
struct PackedBlock {
    openvdb::Coord origin;   ///< of its first voxel, multiples of 8
    std::uint32_t count = 0; ///< active voxels, 1 to 512
    std::array<std::uint64_t, 8>
        mask; ///< bit 8 y + z of word x: voxel (x, y, z) is active; the bits' order is the values'
    std::byte* values = nullptr; ///< in the part's stores: densities, then directions, colours and
                                 ///< `scatter_ratio` where the part has them
};

/// Whether an OpenVDB tree keeps the leaf at `a` before that at `b`: by its nodes of 4096^3, 128^3
/// and 8^3 voxels.
bool inTreeOrder(const openvdb::Coord& a, const openvdb::Coord& b);

/// The active voxels of one material, block by block.
struct PackedPart {
    std::string material;
    MaterialKind kind = MaterialKind::fibre;
    bool has_direction = false, has_colour = false, has_scatter_ratio = false;
    Vec3f uniform_colour{1.0f};      ///< of every voxel, where has_colour is false
    std::vector<PackedBlock> blocks; ///< in the order of an OpenVDB tree
    std::vector<VoxelStore> stores;

    static std::size_t voxelBytes(bool direction, bool colour, bool scatter_ratio = false)
    {
        return sizeof(float) + (direction ? sizeof(Half3) : 0) + (colour ? sizeof(Half3) : 0)
            + (scatter_ratio ? sizeof(Half3) : 0);
    }

    float* density(const PackedBlock& b) const { return reinterpret_cast<float*>(b.values); }
    Half3* direction(const PackedBlock& b) const ///< VolumePart::direction; null: none
    {
        return has_direction ? reinterpret_cast<Half3*>(b.values + b.count * sizeof(float))
                             : nullptr;
    }
    Half3* colour(const PackedBlock& b) const ///< null: uniform_colour
    {
        return has_colour
            ? reinterpret_cast<Half3*>(b.values + b.count * voxelBytes(has_direction, false))
            : nullptr;
    }
    Half3* scatterRatio(const PackedBlock& b) const ///< VolumePart::scatter_ratio; null: none
    {
        return has_scatter_ratio
            ? reinterpret_cast<Half3*>(b.values + b.count * voxelBytes(has_direction, has_colour))
            : nullptr;
    }
    std::size_t voxels() const;
    std::size_t bytes() const;
};

/// What compose() makes and writeVolume() writes: a Volume without trees.
struct PackedVolume {
    openvdb::math::Transform::Ptr transform; ///< cubic voxels
    std::vector<PackedPart> parts;

    double voxelSize() const { return transform->voxelSize()[0]; } ///< edge, world units

    std::size_t voxels() const; ///< active, of all parts
    std::size_t bytes() const;
};

/// The active voxels of a volume. Active tiles become voxels; values of inactive voxels are
/// dropped.
PackedVolume pack(const Volume& volume);

/// As grids. Takes the memory that OpenVDB's leaves take.
Volume unpack(const PackedVolume& volume);

} // namespace volcomp
