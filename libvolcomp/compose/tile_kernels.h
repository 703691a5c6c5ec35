// SPDX-License-Identifier: Apache-2.0
// The vector code of TileAccumulator, chosen for the machine's instruction set when the program
// runs. The results are the same bytes with every instruction set.
#pragma once

#include <cstdint>

#include "volcomp/compose/voxel_sum.h"

namespace volcomp {

/// Cells of a tile and of a margin around it, z fastest. What is added in the margin belongs to
/// the neighbours and is never looked at.
struct TileCells {
    static constexpr int kLog2 = 4, kSize = 1 << kLog2; ///< along an edge, without the margin
    static constexpr int kMargin = 2, kAcross = kSize + 2 * kMargin;
    static constexpr int kCount = kAcross * kAcross * kAcross;

    VoxelSum* sums;        ///< kCount, and one behind them, see gatherCells()
    std::int32_t* touched; ///< kAcross^2: bit z of row (x, y) is set if something was added there
};

/// Voxels of a tile, one array for each channel.
struct TileChannels {
    static constexpr int kMost = TileCells::kSize * TileCells::kSize * TileCells::kSize;
    /// Room for a vector beyond the last voxel. Not a multiple of 4096 bytes: the channels would
    /// crowd each other out of the cache.
    static constexpr int kRow = kMost + 48;

    std::int32_t cell[kRow]; ///< where each voxel is found
    alignas(64) float density[kRow];
    alignas(64) float tensor[6][kRow]; ///< xx, yy, zz, xy, yz, zx
    alignas(64) float squares[kRow];   ///< VoxelSum::kSquares
    alignas(64) float colour[3][kRow]; ///< times density, until divideColours()
    alignas(64) float direction[3][kRow];
    alignas(64) float scatter_ratio[3][kRow]; ///< times density, until divideBy()
    std::int32_t unsure[kRow];                ///< see findDirections()
};

/// Adds the cubes [low, low + width]^3 of the first `count` of a batch: to each cell the cube's sum
/// times the cube's overlap with it. Cubes may reach from -width to kSize + width; 0 < width <= 2.
void addCubes(const CubeBatch& batch, int count, float width, const TileCells& cells);

/// Moves the sums of the cells that c.cell lists into channels, and sets these cells to zero. Up to
/// the next multiple of 16, as vectors read on, the channels are filled from the cell kCount. It
/// must hold density 1 and a tensor that findDirections() is sure of. Without `scatter_ratio` that
/// channel is left out.
void gatherCells(int count, const TileCells& cells, bool scatter_ratio, TileChannels& c);

/// Finds the directions (VolumePart::direction) of the tensors. Lists in c.unsure the voxels whose
/// two largest eigenvalues are too close for single precision, and returns how many these are.
int findDirections(int count, TileChannels& c);

/// Divides three channels by the densities.
void divideByDensity(int count, const TileChannels& c, float (&values)[3][TileChannels::kRow]);

} // namespace volcomp
