// SPDX-License-Identifier: Apache-2.0
// How open the places of a volume are: what comes from outside to a place from each direction, and
// how likely light that is scattered there meets something again (MODEL section 5b).
//
// Coarse cells, each a leaf of the finest level or several, have the optical depth of their mean
// density for light that begins in them, and for light that passes the lesser one of what their
// columns of voxels let through: leaves stand in clumps. From the middle of each cell rays go in
// the directions to its 26 neighbours, through the cells' middles, until they leave the volume. The
// optical depth of a ray is a running sum along these lines, so all cells cost 26 passes over the
// grid. Densities count without direction, as the mean over all directions of directed extinction
// is 1.
//
// It belongs to the volume and its skins alone, not to lights, the picture or colours. Look-ups are
// by world position: all levels of detail share the cells of the finest.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "volcomp/base/vec.h"
#include "volcomp/render/tree/voxel_tree.h"

namespace volcomp {

class SkinTracer;

/// Threads share it; nothing in it changes after it is made. It does not refer to the tree or the
/// skins of which it was made. Without cells everything is open.
class Openness {
public:
    static constexpr int kDirections = 26;
    /// Cells are twice, four times ... as wide as a leaf where the volume's box would have more of
    /// them: so many take half a gigabyte with the directions and three seconds of a processor.
    static constexpr std::size_t kMostCells = std::size_t(1) << 24;

    /// By direction, each 0 to 1; the last two are padding for vectors and 0.
    using ByDirection = std::array<float, 28>;

    /// `extinction` is the optical depth of density 1 over one voxel. Where `skins`, which may be
    /// null, are in the way of a cell's ray, nothing comes along it; such a ray starts at the
    /// middle of the cell's mass, so that short fur does not start inside the body that it grows
    /// on. Cells without mass take what most of their neighbours with mass see, so that those
    /// inside a body do not darken the fur on it. Without `by_direction` it keeps closed() alone, 2
    /// bytes a cell instead of 34. The bytes do not depend on the number of threads.
    Openness(const VoxelTree& tree, double extinction, const SkinTracer* skins = nullptr,
             bool by_direction = true, std::size_t most_cells = kMostCells)
        : Openness(tree, {tree.bounds(), kLeafDim}, extinction, skins, by_direction, most_cells)
    {
    }

    /// Where cells are laid, and how wide they are at least.
    struct Cells {
        openvdb::CoordBBox box; ///< voxels of the tree; all outside is open
        int width;              ///< voxels: a power of two
    };
    /// The same with other cells. All leaves of the tree in their box must be there.
    Openness(const VoxelTree& tree, const Cells& cells, double extinction,
             const SkinTracer* skins = nullptr, bool by_direction = true,
             std::size_t most_cells = kMostCells);

    /// Unit, world axes, to the outside.
    const std::array<Vec3d, kDirections>& directions() const { return m_directions; }
    /// The share of all directions that are nearest to each; they add up to 1.
    static const std::array<double, kDirections>& weights();
    /// The number of the direction that is nearest to `d` (unit, world).
    int nearest(const Vec3d& d) const;

    /// What passes the volume and the skins from outside to a place (world) in the volume.
    ByDirection open(const Vec3d& p) const;
    /// What passes the volume alone; for places on skins, also outside of the volume's box.
    ByDirection openWithoutSkins(const Vec3d& p) const;
    /// P: how much of the light that leaves a place (world) in the volume does not get outside, 1 -
    /// the mean of open(): 0 in the open, 1 deep inside.
    double closed(const Vec3d& p) const;

    bool byDirection() const { return !m_passes.empty(); }
    std::size_t cells() const { return m_closed.size(); } ///< one row around the box included
    double cellSize() const { return m_cell_size; }       ///< world units
    std::size_t memoryBytes() const;

private:
    struct alignas(32) Passes {
        std::array<std::uint8_t, 28> volume{}; ///< 255 x transmittance of the volume
        std::uint32_t visible = kAll;          ///< a bit for each direction that no skin blocks
    };
    static constexpr std::uint32_t kAll = (std::uint32_t(1) << kDirections) - 1;
    /// The eight cells around a place and their shares.
    struct Around {
        std::size_t cells[8];
        float shares[8];
    };
    class Builder;

    /// Cell coordinates: the middle of cell (x,y,z) is at (x,y,z).
    Vec3d toCells(const Vec3d& p) const { return m_rotation * (p - m_first) / m_cell_size; }
    Around around(const Vec3d& at) const;
    std::size_t number(int x, int y, int z) const
    {
        return (std::size_t(x) * m_size[1] + y) * m_size[2] + z;
    }

    std::array<Vec3d, kDirections> m_directions;
    openvdb::math::Mat3d m_rotation; ///< world to grid axes
    Vec3d m_first{0.0};              ///< world position of the middle of the first cell
    double m_cell_size = 1;
    /// Cells, with one row of empty ones on each side of the volume's box.
    std::array<int, 3> m_size{0, 0, 0};
    std::vector<Passes> m_passes;        ///< by cell, if by direction
    std::vector<std::uint16_t> m_closed; ///< by cell: 65535 P, with the skins
};

} // namespace volcomp
