// SPDX-License-Identifier: Apache-2.0
// The coverage of the voxels of one leaf (8^3 voxels) by pieces of strands. Private to baking.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <openvdb/openvdb.h>

#include "volcomp/base/principal_direction.h"
#include "volcomp/base/ray_box.h"
#include "volcomp/grow/grow.h"
#include "volcomp/volume/material.h"

namespace volcomp {

constexpr int kLeaf = 8, kLeafVoxels = 512;

/// A segment measured in cells: voxel (i,j,k) is the cell [i, i+1)^3, so that cells lie half a
/// voxel away from OpenVDB's index space.
struct CellLine {
    Vec3d a, d; ///< the start, and the way to the end
};

/// Returns where a segment runs, in cells of edge `voxel` metres.
inline CellLine inCells(const Segment& s, double voxel)
{
    const Vec3d a = Vec3d(s.a) / voxel + Vec3d(0.5), b = Vec3d(s.b) / voxel + Vec3d(0.5);
    return {a, b - a};
}

/// Returns how far from its axis a segment may reach into cells, in cells, given its larger radius
/// or half width in cells.
double reachInCells(const Segment& s, double size);

constexpr double kMaxCoverage = 0.99; ///< of a voxel's cross-section by one strand

/// Returns the factor on the coverage of a round strand of `radius` voxels, and on area / (2 h^2),
/// the mean projected area, for a flat shape `width` voxels wide: what voxels of one strand behind
/// each other need beside -ln(1 - c). leaf_filler.cpp says where they come from.
double roundFactor(double radius);
double flatFactor(double width);

/// What is known of a voxel while its leaf is being filled.
struct Cell {
    float depth = 0;    ///< sum of -ln(1 - c) over the finished strands: the optical depth
    float squares = 0;  ///< sum of the squares of what each strand adds to the depth
    float coverage = 0; ///< c of the current strand
    float weight = 0;   ///< sum of coverages
    std::array<float, 3> colour{}; ///< linear RGB times coverage
    std::array<float, 6> tensor{}; ///< sum of coverage t t^T: xx, yy, zz, xy, xz, yz
};

/// Fills one leaf at a time: begin(), then add() for each segment that touches the leaf, those of
/// one strand together, then finishStrand(), then cells().
class LeafFiller {
public:
    /// `voxel` is the edge of a voxel, metres. Keeps a reference to the segments.
    LeafFiller(const std::vector<Segment>& segments, MaterialKind kind, double voxel);

    /// Starts an empty leaf whose first voxel is `origin`.
    void begin(const openvdb::Coord& origin);

    /// Adds the part of a segment that lies in the leaf.
    void add(std::uint32_t index);

    /// Turns the coverage of the current strand into depth.
    void finishStrand();

    /// The voxels of the leaf in OpenVDB's order: z runs fastest.
    const std::array<Cell, kLeafVoxels>& cells() const { return m_cells; }

private:
    struct Piece;

    void addThin(const Piece& piece, LineRange range);
    void addThick(const Piece& piece, LineRange range);
    void addFlat(const Piece& piece);
    void walk(const Piece& piece, const CellLine& line, LineRange range, double w_a, double w_b,
              const SymmetricTensor& tensor);
    void deposit(int index, double coverage, const Segment& s, double t,
                 const SymmetricTensor& tensor);

    const std::vector<Segment>& m_segments;
    MaterialKind m_kind;
    double m_voxel;
    Vec3d m_low{0.0}; ///< the leaf's corner, in cells
    std::array<Cell, kLeafVoxels> m_cells;
    std::array<std::uint16_t, kLeafVoxels> m_touched_list; ///< voxels of the current strand
    int m_touched = 0;
    std::uint32_t m_strand = ~0U;
};

} // namespace volcomp
