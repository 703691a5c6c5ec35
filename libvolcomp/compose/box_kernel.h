// SPDX-License-Identifier: Apache-2.0
// The vector code of PlacedBox::add(), chosen for the machine's instruction set when the program
// runs. The results are the same bytes with every instruction set.
#pragma once

#include <cstdint>

#include "volcomp/compose/box_source.h"
#include "volcomp/compose/tile_accumulator.h"

namespace volcomp {

class BoxTint;

/// Positions are rounded to multiples of 1/4096 voxel, so that aligned boxes stay aligned.
constexpr float kSnap = 4096;

/// One part of a box as one tile sees it. Coordinates are the tile's: its cell i is [i, i+1), edges
/// are voxels of the target.
struct BoxInTile {
    /// Bounds of runs of voxels, or of groups of bounds: see BoundsList.
    struct Level {
        const float* values[6];
    };
    static constexpr int kMostLevels = 8; ///< enough for 16^9 voxels

    float axes[3][3];                  ///< along the box's x, y, z for one of its voxels
    float root[3];                     ///< corner of the box's voxel (0,0,0), as PlacedBox::m_root
    int divisions;                     ///< of a voxel along an edge
    float width;                       ///< of the cubes
    alignas(16) float turn[3][4];      ///< unit axes, and 0
    alignas(16) float turn_next[3][4]; ///< their y, z, x, and 0
    alignas(16) float colour[4];       ///< factors of red, green, blue and density
    float direction;                   ///< factor of the sum of t tᵀ
    BoxTint* tint;                     ///< may be null

    const float* place[3]; ///< SourcePart::x, y, z
    const SourceVoxel* voxels;
    const float* squares;               ///< SourcePart::squares; may be null
    float square;                       ///< their factor
    const ScatterRatio* scatter_ratios; ///< SourcePart::scatter_ratios; may be null
    std::uint32_t voxel_count;
    Level levels[kMostLevels];
    int level_count;
};

/// The parts of a run's divided voxels that may reach into a tile: along each edge of a voxel, the
/// numbers [begin, end) of parts, in increasing order and without overlap.
struct ReachedParts {
    struct Range {
        int begin, end;
    };
    Range ranges[3][SourcePart::kRun];
    int count[3]; ///< of ranges; all are 0 if no part reaches into the tile
};

/// Returns which parts of the kRun voxels from `begin` on may reach into the tile. What it leaves
/// out does not.
ReachedParts reachedParts(const BoxInTile& box, std::uint32_t begin);

/// Adds the cubes of the box's voxels that reach into the tile.
void addBox(const BoxInTile& box, TileAccumulator& tile);

} // namespace volcomp
