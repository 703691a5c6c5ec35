// The volume as the renderer reads it: three levels (hash of 128^3 blocks, table of 8^3 leaves,
// voxels), the density of all parts as plain floats and the rest of a voxel in one record of 8
// bytes.
//
// A record holds a direction (sign free, 2 x 12 bits, error < 7e-4 rad), its spread (6 bits, error
// < 0.0081), a colour (3 x 10 bits of the square root, error < 0.1 % of the brightest colour in the
// leaf) and the part. Where parts meet, the record points to a list instead, so that a volume of
// one part pays nothing for them. Active tiles are leaves of one record that any number of places
// share.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <openvdb/math/BBox.h>
#include <openvdb/math/Coord.h>

#include "volcomp/volume/material.h"
#include "volcomp/base/progress.h"
#include "volcomp/base/vec.h"
#include "volcomp/volume/volume.h"

namespace volcomp {

constexpr int kLeafDim = 8, kBlockDim = 128; ///< voxels along an edge

/// One part's particles in one voxel, unpacked.
struct VoxelContent {
    int part = 0;
    float density = 0; ///< of this part, 1 / world length
    bool directed = false;
    int spread_code = 0;  ///< 0 ... 62; spread = spread_code / 62
    Vec3d direction{0.0}; ///< unit where directed
    Vec3d colour{1.0};
};

/// A volume as rays want it; immutable.
class VoxelTree {
public:
    static constexpr int kEmpty = -1;
    static constexpr int kSpreadCodes = 63;
    static double spreadOf(int code) { return code / double(kSpreadCodes - 1); }

    /// 8^3 voxels: which hold particles, and where their records begin.
    struct Leaf {
        std::array<std::uint64_t, 8> mask{};   ///< voxels of density > 0; word x, bit y * 8 + z
        std::array<std::uint16_t, 8> before{}; ///< voxels in the words before
        std::uint32_t first = 0;               ///< record of the first voxel
        float colour_scale = 1;
        bool uniform = false;         ///< all voxels have the first record (an active tile)
        bool directed_fibres = false; ///< some voxel's extinction depends on the ray's direction
    };

    /// Packs a volume. Throws Error where a density is not finite or is negative, the grids'
    /// transforms differ or are not a uniform scale with rotation and translation, or there are
    /// more voxels than 2^32.
    explicit VoxelTree(const Volume& volume);
    /// The same, emptying each leaf of the grids as soon as it is packed, whoever else holds them.
    /// With grids whose leaves are still in the file (readVolume(), delayed), the peak is the tree
    /// and the grids' topology.
    explicit VoxelTree(Volume&& volume, const Progress& progress = {});

    /// The same particles in voxels of twice the width, which keep the mean transmittance at `tau`
    /// of the columns through them and what they show of light (coarserVoxel()), and the spread of
    /// the directions. Coarse voxel i holds the fine 2 i and 2 i + 1; toCorner() gives half the
    /// fine coordinates.
    static VoxelTree coarser(const VoxelTree& fine, double tau);

    /// What a part's grids said about it.
    struct Part {
        std::string material;
        MaterialKind kind;
    };
    const std::vector<Part>& parts() const { return m_parts; }

    bool empty() const { return m_leaves.empty(); }
    double voxelSize() const { return m_voxel; }
    std::uint64_t voxelCount() const { return m_voxels; } ///< of density > 0, tiles included
    std::size_t leafCount() const { return m_leaves.size(); }
    std::size_t memoryBytes() const; ///< of all tables
    std::size_t densityBytes() const { return m_density.size() * sizeof(float); }
    const openvdb::CoordBBox& bounds() const
    {
        return m_bounds;
    }                                                ///< voxels, whole leaves, inclusive
    const Vec3d& origin() const { return m_origin; } ///< world position of corner coordinates 0
    bool hasDirectedFibres() const { return m_directed_fibres; }
    float maxDensity() const { return m_max_density; }

    /// Corner coordinates: voxel (i,j,k) is the cube [i,i+1) x [j,j+1) x [k,k+1), one unit a voxel,
    /// axes of the grid.
    Vec3d toCorner(const Vec3d& p_world) const;
    Vec3d directionToCorner(const Vec3d& d_world) const
    {
        return m_rotation * d_world;
    } ///< keeps the length
    Vec3d directionToWorld(const Vec3d& d_corner) const
    {
        return m_rotation.transpose() * d_corner;
    }

    /// The block that holds voxel (x,y,z): kEmpty or its number.
    int block(int x, int y, int z) const
    {
        const std::uint64_t key = blockKey(x >> 7, y >> 7, z >> 7);
        for (std::size_t i = hash(key);; ++i) {
            const Slot& slot = m_slots[i & m_slot_mask];
            if (slot.block == kEmpty || slot.key == key) return slot.block;
        }
    }
    /// The leaf of a block that holds voxel (x,y,z): kEmpty or its number.
    int leafIn(int block, int x, int y, int z) const
    {
        return m_children[std::size_t(block) * 4096
                          + ((x >> 3 & 15) << 8 | (y >> 3 & 15) << 4 | (z >> 3 & 15))];
    }
    int leafAt(int x, int y, int z) const
    {
        const int b = block(x, y, z);
        return b == kEmpty ? kEmpty : leafIn(b, x, y, z);
    }
    const Leaf& leaf(int index) const { return m_leaves[index]; }
    const float* densities(int leaf) const { return &m_density[std::size_t(leaf) * 512]; }
    static int offset(int x, int y, int z) { return (x & 7) << 6 | (y & 7) << 3 | (z & 7); }
    float density(int x, int y, int z) const
    {
        const int l = leafAt(x, y, z);
        return l == kEmpty ? 0 : densities(l)[offset(x, y, z)];
    }

    /// Calls f(origin, leaf) for every place of 8^3 voxels that has a leaf, in a fixed order.
    template <class F>
    void forEachCell(F&& f) const
    {
        for (const Slot& slot : m_slots) {
            if (slot.block == kEmpty) continue;
            const auto axis = [&](int shift) {
                return int(std::int32_t(slot.key >> shift & 0x1fffff) << 11) >> 11;
            }; // 21 bits with sign
            const openvdb::Coord origin(axis(42) * kBlockDim, axis(21) * kBlockDim,
                                        axis(0) * kBlockDim);
            for (int n = 0; n < 4096; ++n)
                if (const int l = m_children[std::size_t(slot.block) * 4096 + n]; l != kEmpty)
                    f(origin.offsetBy((n >> 8) * 8, (n >> 4 & 15) * 8, (n & 15) * 8), l);
        }
    }

    /// Number of a voxel's record; the voxel must have density > 0.
    std::uint32_t recordIndex(const Leaf& l, int voxel) const
    {
        if (l.uniform) return l.first;
        const int word = voxel >> 6;
        const std::uint64_t lower = l.mask[word] & ((std::uint64_t(1) << (voxel & 63)) - 1);
        return l.first + l.before[word] + std::uint32_t(__builtin_popcountll(lower));
    }

    /// Calls f(const VoxelContent&) for each part in a voxel of density > 0.
    template <class F>
    void contents(int leaf, int voxel, F&& f) const
    {
        const Leaf& l = m_leaves[leaf];
        const std::uint64_t record = m_records[recordIndex(l, voxel)];
        if (record >> 60 != kShared) {
            f(unpack(record, densities(leaf)[voxel], l.colour_scale));
            return;
        }
        const std::uint64_t start = record & 0xffffffff, count = record >> 32 & 0xffff;
        for (std::uint64_t i = start; i < start + count; ++i) {
            VoxelContent content = unpack(m_shared[i].record, m_shared[i].density, l.colour_scale);
            content.part = m_shared[i].part;
            f(content);
        }
    }

    /// What multiplies a voxel's density along a ray of unit direction `d_world` under fibre
    /// extinction: the density-weighted mean over its parts of (4/pi) times the mean sine between
    /// ray and fibres, 1 for surfaces and voxels without direction.
    double fibreFactor(int leaf, int voxel, const Vec3d& d_world) const
    {
        const Leaf& l = m_leaves[leaf];
        const std::uint64_t record = m_records[recordIndex(l, voxel)];
        if (record >> 60 != kShared) return recordFactor(record, int(record >> 60), d_world);
        return sharedFactor(record, d_world);
    }
    /// The same for one part's particles.
    double fibreFactor(const VoxelContent& content, const Vec3d& d_world) const;

    /// How much less light a voxel of density > 0 shows than one whose particles lie evenly in it
    /// (CoarserVoxel), where eye and light lie in the directions V and L, unit length. 1 in a tree
    /// that was not made by coarser().
    double scatterRatio(int leaf, int voxel, const Vec3d& V, const Vec3d& L) const
    {
        if (m_scatter_ratio.empty()) return 1;
        const ScatterRatio& s = m_scatter_ratio[recordIndex(m_leaves[leaf], voxel)];
        const double cosine = V.dot(L);
        return s[1] + std::abs(cosine) * (s[cosine > 0 ? 0 : 2] - s[1]);
    }
    using ScatterRatio = std::array<float, 3>; ///< where the light comes from the side of the eye,
                                               ///< from across, from behind
    ScatterRatio scatterRatio(int leaf, int voxel) const
    {
        return m_scatter_ratio.empty() ? ScatterRatio{1, 1, 1}
                                       : m_scatter_ratio[recordIndex(m_leaves[leaf], voxel)];
    }

private:
    VoxelTree() = default;
    /// `direction` has the length 1 - spread.
    static std::uint64_t pack(const Vec3f& direction, const Vec3f& colour, float colour_scale,
                              int part);
    static constexpr std::size_t kMostParts = 15; ///< that a record can name
    static constexpr std::uint64_t kShared = 15;  ///< "part" of a record that points to a list
    struct Slot {
        std::uint64_t key = 0;
        int block = kEmpty;
    };
    struct Shared {
        std::uint64_t record;
        float density;
        std::int32_t part;
    };
    class Builder;
    static void coarsenLeaf(const VoxelTree& fine, int child, int octant, double extinction,
                            float* density, Leaf& leaf,
                            std::array<ScatterRatio, 512>& scatter_ratio);
    void readTransform(const Volume& volume);

    static std::uint64_t blockKey(int x, int y, int z)
    {
        return (std::uint64_t(x) & 0x1fffff) << 42 | (std::uint64_t(y) & 0x1fffff) << 21
            | (std::uint64_t(z) & 0x1fffff);
    }
    static std::size_t hash(std::uint64_t key)
    {
        return std::size_t((key ^ key >> 29) * 0x9e3779b97f4a7c15ULL >> 32);
    }
    static VoxelContent unpack(std::uint64_t record, float density, float colour_scale);
    static Vec3d unpackDirection(std::uint64_t record)
    {
        const double u = (double(record & 4095) - 2047) / 2047,
                     v = (double(record >> 12 & 4095) - 2047) / 2047;
        const double x = 0.5 * (u + v), y = 0.5 * (u - v), z = 1 - std::abs(x) - std::abs(y);
        const double s = 1 / std::sqrt(x * x + y * y + z * z);
        return {x * s, y * s, z * s};
    }
    double recordFactor(std::uint64_t record, int part, const Vec3d& d) const
    {
        const int code = int(record >> 24 & 63);
        if (code == kSpreadCodes || !m_is_fibre[part]) return 1;
        const double cosine = unpackDirection(record).dot(d);
        return std::sqrt(std::max(0.0, m_factor_a[code] - m_factor_b[code] * cosine * cosine));
    }
    double sharedFactor(std::uint64_t record, const Vec3d& d) const;

    double m_voxel = 1;
    Vec3d m_origin{0.0};
    openvdb::math::Mat3d m_rotation; ///< world to grid axes
    openvdb::CoordBBox m_bounds;
    std::vector<Slot> m_slots;
    std::size_t m_slot_mask = 0;
    std::vector<std::int32_t> m_children; ///< 4096 a block
    std::vector<Leaf> m_leaves;
    std::vector<float> m_density; ///< 512 a leaf
    std::vector<std::uint64_t> m_records;
    std::vector<Shared> m_shared;
    std::vector<ScatterRatio> m_scatter_ratio; ///< by record; of coarser trees
    std::vector<Part> m_parts;
    std::vector<char> m_is_fibre; ///< by part
    std::array<double, 64> m_factor_a{}, m_factor_b{};
    std::uint64_t m_voxels = 0;
    float m_max_density = 0;
    bool m_directed_fibres = false;
};

/// A voxel that stands for 2 x 2 x 2.
struct CoarserVoxel {
    double density; ///< for each axis -ln of the mean transmittance of the four columns, over their
                    ///< length; the mean of the three
    /// Light that is scattered once inside, over that of a homogeneous voxel of that density: the
    /// mean over the axes. Particles that lie in clumps shade each other and hide what they light,
    /// which the mean transmittance does not tell. 1 where the eight are equal.
    VoxelTree::ScatterRatio scatter_ratio;
};
/// Of the eight densities (4 x + 2 y + z) and what they show themselves. `extinction` is the
/// optical depth of density 1 over one of the eight; 0: the mean density.
CoarserVoxel coarserVoxel(const double* densities, const VoxelTree::ScatterRatio* scatter_ratio,
                          double extinction);

} // namespace volcomp
