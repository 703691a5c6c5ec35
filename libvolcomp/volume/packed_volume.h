// SPDX-License-Identifier: Apache-2.0
// A volume's active voxels alone, packed: what compose() makes and what files are written from.
//
// An OpenVDB leaf keeps 512 values however few are active, 28 bytes for each density, direction and
// colour. Composed fur fills a sixth of its leaves, so packed it takes a tenth of that memory, and
// composing spends its time on memory.
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

inline Half3 toHalves(const Vec3f& v)
{
    using openvdb::math::half;
    return {half(v[0]), half(v[1]), half(v[2])};
}
inline Vec3f fromHalves(const Half3& h) { return {float(h[0]), float(h[1]), float(h[2])}; }

/// Memory for voxels, given out from large chunks and freed all at once. It can be moved, but not
/// copied; pointers into it stay good when it is moved. Not for several threads at once.
class VoxelStore {
public:
    /// Aligned to 8 bytes; not initialised. Throws std::bad_alloc.
    std::byte* allocate(std::size_t bytes);
    /// Takes back all that was given out, and keeps the last chunk, which is the largest.
    void reuse();

    std::size_t bytes() const { return m_bytes; } ///< of all chunks

private:
    struct Free {
        void operator()(std::byte* p) const;
    };
    std::vector<std::unique_ptr<std::byte[], Free>> m_chunks;
    std::byte* m_next = nullptr;
    std::size_t m_left = 0, m_bytes = 0, m_last = 0; ///< m_last: bytes of the last chunk
};

/// 8^3 voxels of which some are active: an OpenVDB leaf. A copy points to the same values.
struct PackedBlock {
    openvdb::Coord origin;   ///< of its first voxel, multiples of 8
    std::uint32_t count = 0; ///< active voxels, 1 to 512
    /// Bit 8 y + z of word x: voxel (x, y, z) is active. Values come in the order of the bits.
    std::array<std::uint64_t, 8> mask;
    /// Owned by the part's stores: densities, then directions, colours, scatter ratios and own
    /// shares, as far as the part has them.
    std::byte* values = nullptr;
};

/// True if an OpenVDB tree keeps the leaf at `a` before that at `b`. Its order is that of its nodes
/// of 4096^3 voxels, then of 128^3, then of 8^3.
bool inTreeOrder(const openvdb::Coord& a, const openvdb::Coord& b);

/// The active voxels of one material, block by block. The functions that take a block want one of
/// this part's. It can be moved, but not copied.
struct PackedPart {
    std::string material;
    MaterialKind kind = MaterialKind::fibre;
    bool has_direction = false, has_colour = false, has_scatter_ratio = false,
         has_own_share = false;
    Vec3f uniform_colour{1.0f};      ///< of every voxel, if has_colour is false
    std::vector<PackedBlock> blocks; ///< in the order of an OpenVDB tree
    std::vector<VoxelStore> stores;

    /// Bytes that the values of a voxel take.
    static std::size_t voxelBytes(bool direction, bool colour, bool scatter_ratio = false,
                                  bool own_share = false)
    {
        return sizeof(float) + (direction ? sizeof(Half3) : 0) + (colour ? sizeof(Half3) : 0)
            + (scatter_ratio ? sizeof(Half3) : 0) + (own_share ? sizeof(openvdb::math::half) : 0);
    }
    std::size_t voxelBytes() const
    {
        return voxelBytes(has_direction, has_colour, has_scatter_ratio, has_own_share);
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
    openvdb::math::half* ownShare(const PackedBlock& b) const ///< VolumePart::own_share; null: none
    {
        return has_own_share ? reinterpret_cast<openvdb::math::half*>(
                   b.values + b.count * voxelBytes(has_direction, has_colour, has_scatter_ratio))
                             : nullptr;
    }
    std::size_t voxels() const; ///< active
    std::size_t bytes() const;  ///< of memory
};

/// What compose() makes and writeVolume() writes: a Volume without trees. It can be moved, but not
/// copied.
struct PackedVolume {
    openvdb::math::Transform::Ptr transform; ///< cubic voxels
    std::vector<PackedPart> parts;

    double voxelSize() const { return transform->voxelSize()[0]; } ///< edge, world units

    std::size_t voxels() const; ///< active, of all parts
    std::size_t bytes() const;  ///< of memory
};

/// The active voxels of a volume. Active tiles become voxels; values of inactive voxels are
/// dropped. All but densities is rounded to half floats. The result shares no
/// voxels with `volume`.
PackedVolume pack(const Volume& volume);

/// The same voxels as grids, with the memory that OpenVDB's leaves take. The renderer needs no
/// grids: it reads a packed volume through a PackedSource (block_source.h). The result shares no
/// voxels with `volume`.
Volume unpack(const PackedVolume& volume);

} // namespace volcomp
