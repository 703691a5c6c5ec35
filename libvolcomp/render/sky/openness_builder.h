// SPDX-License-Identifier: Apache-2.0
// How the cells of an Openness are filled; openness.cpp alone uses it.
#pragma once

#include <vector>

#include "volcomp/render/sky/openness.h"

namespace volcomp {

/// Fills the cells. All references must outlive this.
class Openness::Builder {
public:
    Builder(Openness& openness, const VoxelTree& tree, const Cells& cells, double extinction,
            bool by_direction);

    /// Lays the cells over their box.
    void layCells(std::size_t most_cells);
    void addDensities();
    void lookForSkins(const SkinTracer& skins);
    void passAll(); ///< all directions, and then P

private:
    /// The particles of one lump: a leaf, or as much of one as lies in a cell.
    struct Lump {
        double mass = 0;   ///< sum of the densities
        Vec3d moment{0.0}; ///< sum of density times place in the leaf, voxels
        double depth = 0;  ///< optical depth of its width for what passes through it
    };
    /// A lump where it stands.
    struct Place {
        std::size_t cell;
        openvdb::Coord origin; ///< of its leaf
        std::size_t lump;
    };
    /// Calls f(cell, origin of the leaf, number of the lump) for all lumps in the box.
    template <class F>
    void forEachLump(F&& f) const;
    int lumpOf(int voxel) const; ///< in its leaf
    int firstOf(int lump) const; ///< voxel of a leaf's lump
    std::size_t cellOf(const openvdb::Coord& origin) const;
    Vec3d middleOfMass(const Place* first, const Place* last) const; ///< world
    void giveToEmptyCells();
    void pass(int direction);
    void passAcross(int direction, const int* step);
    void passInPlane(int direction, const int* step);
    void passRow(int direction, std::size_t first, const float* before, float* after);
    void keep(int direction, std::size_t cell, float depth);

    Openness& m_openness;
    const VoxelTree& m_tree;
    const Cells m_cells;
    const double m_extinction;
    const bool m_by_direction;
    int m_width = 0;             ///< of a cell, voxels
    int m_low[3] = {0, 0, 0};    ///< of the first cell with voxels, in cells
    int m_lump_width = kLeafDim; ///< voxels
    int m_lumps_across = 1, m_lumps_of_leaf = 1;
    std::vector<Lump> m_lumps; ///< by leaf, and in it x, y, z
    /// By cell: the optical depth of its width along an axis for what passes through it, and for
    /// what begins in it, where its particles are.
    std::vector<float> m_depth, m_own_depth;
    float m_weight = 0;                   ///< of the direction at hand
    std::vector<float> m_escapes;         ///< by cell: sum over directions, 1 - P
    std::vector<std::uint32_t> m_visible; ///< by cell, if there are skins
};

} // namespace volcomp
