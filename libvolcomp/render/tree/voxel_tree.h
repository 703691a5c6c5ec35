// SPDX-License-Identifier: Apache-2.0
// The volume as rays read it: a table of nodes of 128^3 voxels (node_table.h), leaves of 8^3
// voxels, the density of all parts in those that hold something as plain floats, and the rest of a
// voxel in one record of 8 bytes (voxel_record.h). Blocks in which all voxels are the same are
// leaves of one record, which any number of places share.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <openvdb/math/BBox.h>
#include <openvdb/math/Coord.h>

#include "volcomp/base/progress.h"
#include "volcomp/base/vec.h"
#include "volcomp/volume/coarser_voxel.h"
#include "volcomp/render/tree/node_table.h"
#include "volcomp/render/tree/tile_store.h"
#include "volcomp/render/tree/tree_leaf.h"
#include "volcomp/render/tree/voxel_record.h"
#include "volcomp/volume/block_source.h"
#include "volcomp/volume/material.h"
#include "volcomp/volume/tile_maker.h"

namespace volcomp {

/// A volume to send rays through. Rays see the same whatever was asked before; a tree of a
/// TileMaker makes its leaves when they are first asked for. It can be moved, but not copied.
class VoxelTree {
public:
    static constexpr int kEmpty = NodeTable::kEmpty;

    using Leaf = TreeLeaf;

    /// Takes all blocks of a source, on all threads; the result does not depend on their number.
    /// The peak of memory is the tree and what the source holds. Throws Error if a density is not
    /// finite or is negative (see kTinyNegative), the transform is not a uniform scale with
    /// rotation and translation, or there are more than 2^32 voxels.
    explicit VoxelTree(const BlockSource& source, const Progress& progress = {});
    /// The same for a volume in memory, which stays as it is.
    explicit VoxelTree(const Volume& volume);
    /// A tree whose leaves are made when node(), leafIn() or leafAt() ask for them, tile by tile,
    /// from any thread. They stay, and count in the budget, which must not be null; once that is
    /// spent, asking throws Error. Leaves are numbered in the order in which they are made;
    /// everything else depends on the maker alone. The constructor throws as the others do.
    VoxelTree(std::shared_ptr<const TileMaker> maker, std::shared_ptr<TileBudget> budget);

    VoxelTree(VoxelTree&&) = default;
    VoxelTree& operator=(VoxelTree&&) = default;
    VoxelTree(const VoxelTree&) = delete;
    VoxelTree& operator=(const VoxelTree&) = delete;

    /// The same particles in voxels of twice the width, which keep the mean transmittance at `tau`
    /// of the columns through them, the light that they scatter (coarserVoxel()), and the spread of
    /// the directions. Coarse voxel i holds the fine voxels 2 i and 2 i + 1; toCorner() gives half
    /// the fine coordinates.
    static VoxelTree coarser(const VoxelTree& fine, double tau);

    /// BlockSource::warnings(), and whether densities a little below 0 counted as 0.
    const std::vector<std::string>& warnings() const { return m_warnings; }

    /// What the source said about a part.
    struct Part {
        std::string material;
        MaterialKind kind;
    };
    const std::vector<Part>& parts() const { return m_parts; }

    bool empty() const { return m_bounds.empty(); }
    double voxelSize() const { return m_voxel; } ///< edge, world units
    /// Of density > 0, tiles included; with a maker, and in the next two, those made so far.
    std::uint64_t voxelCount() const;
    std::size_t leafCount() const;
    std::size_t memoryBytes() const; ///< of all tables
    /// The store that makes the leaves; null if all are there.
    const TileStore* tiles() const { return m_tiles.get(); }
    /// Voxels from lowest to highest, inclusive; whole leaves.
    const openvdb::CoordBBox& bounds() const { return m_bounds; }
    const Vec3d& origin() const { return m_origin; } ///< world position of corner coordinates 0
    bool isDirected() const { return m_directed; }
    float maxDensity() const { return m_max_density; } ///< of all parts together; 0 with a maker

    /// Corner coordinates: voxel (i,j,k) is the cube [i,i+1) x [j,j+1) x [k,k+1), one unit a voxel,
    /// axes of the grid.
    Vec3d toCorner(const Vec3d& p_world) const;
    Vec3d toWorld(const Vec3d& p_corner) const
    {
        return m_origin + m_voxel * directionToWorld(p_corner);
    }
    /// Directions keep their length.
    Vec3d directionToCorner(const Vec3d& d_world) const { return m_rotation * d_world; }
    Vec3d directionToWorld(const Vec3d& d_corner) const
    {
        return m_rotation.transpose() * d_corner;
    }

    /// The number of the node that holds voxel (x,y,z), or kEmpty.
    int node(int x, int y, int z) const
    {
        return m_tiles ? m_tiles->node(x, y, z) : m_places.node(x, y, z);
    }
    /// The number of the leaf that holds voxel (x,y,z), which lies in this node, or kEmpty.
    int leafIn(int node, int x, int y, int z) const
    {
        return m_tiles ? m_tiles->leafIn(node, x, y, z) : m_places.leafIn(node, x, y, z);
    }
    /// The number of the leaf that holds voxel (x,y,z), or kEmpty.
    int leafAt(int x, int y, int z) const
    {
        const int n = node(x, y, z);
        return n == kEmpty ? kEmpty : leafIn(n, x, y, z);
    }
    /// A number for the place of a leaf in its node, which stays when leaves are dropped and made
    /// anew (TileBudget::relieve()): that of the leaf, if all leaves are there.
    std::size_t place(int node, int leaf, const int* voxel) const
    {
        return m_tiles ? std::size_t(node) * kNodeSize
                + std::size_t(numberInNode(voxel[0], voxel[1], voxel[2]))
                       : std::size_t(leaf);
    }
    /// One above the greatest of these numbers, so far.
    std::size_t placeCount() const { return m_tiles ? m_tiles->placeCount() : m_leaves.size(); }
    const Leaf& leaf(int index) const { return m_at.leaves[index]; }
    /// 512 densities of all parts together, 1 / world length, by offset().
    LeafDensities densities(int leaf) const { return {m_at.leaves[leaf], m_at.density}; }
    /// The place of voxel (x,y,z) in its leaf; "voxel" below.
    static int offset(int x, int y, int z) { return numberInLeaf(x, y, z); }
    float density(int x, int y, int z) const
    {
        const int l = leafAt(x, y, z);
        return l == kEmpty ? 0 : densities(l)[offset(x, y, z)];
    }

    /// Calls f(origin, leaf) for every place of 8^3 voxels that has a leaf, in a fixed order; with
    /// a maker those that are there, in any order.
    template <class F>
    void forEachCell(F&& f) const
    {
        if (m_tiles) m_tiles->forEachPlace(f);
        else m_places.forEachPlace(f);
    }

    /// Calls f(const VoxelContent&) for each part in a voxel of density > 0.
    template <class F>
    void contents(int leaf, int voxel, F&& f) const
    {
        const Leaf& l = m_at.leaves[leaf];
        const VoxelRecord record = m_at.records[l.recordIndex(voxel)];
        if (!record.isList()) {
            f(record.content(m_at.density[l.recordIndex(voxel)], l.colour_scale));
            return;
        }
        const ListedRecord* entry = m_at.listed + record.listStart();
        for (const ListedRecord* end = entry + record.listCount(); entry != end; ++entry) {
            VoxelContent content = entry->record.content(entry->density, l.colour_scale);
            content.part = entry->part;
            f(content);
        }
    }

    /// What multiplies a voxel's density along a ray of unit direction `d_world` under directed
    /// extinction: the density-weighted mean over its parts of (4/pi) times the mean sine between
    /// ray and fibres, 2 times the mean cosine between ray and normals, and 1 for particles without
    /// direction. The voxel must have density > 0.
    double directionFactor(int leaf, int voxel, const Vec3d& d_world) const
    {
        const VoxelRecord record = m_at.records[m_at.leaves[leaf].recordIndex(voxel)];
        if (!record.isList()) return recordFactor(record, record.part(), d_world);
        return sharedFactor(record, d_world);
    }
    /// The same for one part's particles.
    double directionFactor(const VoxelContent& content, const Vec3d& d_world) const;

    /// The scatter ratio of a voxel of density > 0; 1 in a tree that was neither made by coarser()
    /// nor has some from its source.
    ScatterRatio scatterRatio(int leaf, int voxel) const
    {
        return m_at.scatter_ratio ? m_at.scatter_ratio[m_at.leaves[leaf].recordIndex(voxel)]
                                  : kHomogeneous;
    }
    /// The same for an eye in direction V and light from direction L, unit length.
    double scatterRatio(int leaf, int voxel, const Vec3d& V, const Vec3d& L) const
    {
        if (!m_at.scatter_ratio) return 1;
        const ScatterRatio& s = m_at.scatter_ratio[m_at.leaves[leaf].recordIndex(voxel)];
        const double cosine = V.dot(L);
        return s[1] + std::abs(cosine) * (s[cosine > 0 ? 0 : 2] - s[1]);
    }

private:
    VoxelTree() = default;
    class Builder;   // from a source
    class Coarsener; // from a finer tree

    void setTransform(const openvdb::math::Transform& transform);
    // Sums over all leaves, and lets rays read them; `uses` is how many places have the leaf.
    void finish(const std::vector<std::uint64_t>& uses);
    double recordFactor(const VoxelRecord& record, int part, const Vec3d& d) const
    {
        if (!record.directed()) return 1;
        return m_direction_factors.at(m_parts[part].kind, record.spreadCode(),
                                      record.direction().dot(d));
    }
    double sharedFactor(const VoxelRecord& record, const Vec3d& d) const;

    LeafTables m_at; ///< where rays read: in the vectors below, or in m_tiles
    std::unique_ptr<TileStore> m_tiles;
    double m_voxel = 1;
    Vec3d m_origin{0.0};
    openvdb::math::Mat3d m_rotation; ///< world to grid axes
    openvdb::CoordBBox m_bounds;
    NodeTable m_places;
    std::vector<Leaf> m_leaves;
    std::vector<float> m_density; ///< by record
    std::vector<VoxelRecord> m_records;
    std::vector<ListedRecord> m_listed;
    std::vector<ScatterRatio> m_scatter_ratio; ///< by record; of coarser trees
    std::vector<Part> m_parts;
    std::vector<std::string> m_warnings;
    DirectionFactors m_direction_factors;
    std::uint64_t m_voxel_count = 0;
    float m_max_density = 0;
    bool m_directed = false;
};

} // namespace volcomp
