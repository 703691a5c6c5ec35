// Volumes in VDB files that other programs understand: fog volumes named `density`, `tangentu` or
// `N`, and `Cd` (or `color`).
//
// A volume of one material has those names; with several, each part's grids carry the material's
// name behind an underscore
// (`density_bark`, `N_bark`, `Cd_bark`) and a further grid `density` is their sum, for other
// programs. A direction or colour that is the same everywhere is not a grid but metadata of its
// density grid. That metadata:
//
//     volcomp_material   name of the part's material
//     volcomp_kind       "fibre" or "surface"
//     volcomp_colour     the colour of every voxel, where there is no colour grid
//     volcomp_direction  the direction of every voxel, where there is no direction grid
//     volcomp_scatter_ratio      the scatter ratio of every voxel, where there is no such grid
//
// Files of coarser levels (voxel_levels.h) have one more grid a part, `scatter_ratio`:
// VoxelTree::ScatterRatio.
//
// Grids are stored as half floats where their range allows it: an error of at most 2^-11 of each
// value. Directions keep the spread of MODEL section 8 in their length (volume.h).
#pragma once

#include <filesystem>
#include <string>

#include "volcomp/volume/packed_volume.h"
#include "volcomp/base/progress.h"
#include "volcomp/base/words.h"

namespace volcomp {

class VoxelTree;

/// Whose names the grids of a file have. Only the colour differs; all are read.
enum class GridNames {
    houdini, ///< `Cd`
    blender  ///< `color`
};
constexpr Word<GridNames> kGridNamesWords[] = {{"houdini", GridNames::houdini},
                                               {"blender", GridNames::blender}};

/// Writes the volume; the file appears under its name when it is complete. `extra` is added to the
/// file's metadata. Active tiles become voxels, and values of inactive voxels are dropped. Leaves
/// are compressed in parallel; their bytes do not depend on the number of threads. Throws Error
/// where the file cannot be written or the volume has no parts.
void writeVolume(const std::filesystem::path& file, const PackedVolume& volume,
                 const openvdb::MetaMap& extra = {}, GridNames names = GridNames::houdini);
void writeVolume(const std::filesystem::path& file, const Volume& volume,
                 const openvdb::MetaMap& extra = {}, GridNames names = GridNames::houdini);

/// Reads a volume, also one that no tool of ours made: a lone `density` grid is enough; directions
/// in such a file are normalised. With `delayed`, leaves are read from the file when they are first
/// touched, values are not checked here but left to the caller, and a direction that is the same
/// everywhere is the background of a grid without leaves. Throws Error for a missing, truncated or
/// foreign file, a grid of the wrong type or name, a transform that is not uniform scale and
/// translation, and for NaN, infinite or negative densities.
Volume readVolume(const std::filesystem::path& file, bool delayed = false);

/// Reads a volume into the renderer's form, leaf by leaf: the peak is the result and the topology
/// of the file's grids. Throws Error as readVolume().
VoxelTree readVoxelTree(const std::filesystem::path& file, const Progress& progress = {});

/// The metadata of the file itself (not of its grids), as writeVolume's `extra`. Throws Error as
/// readVolume().
openvdb::MetaMap readVolumeMetadata(const std::filesystem::path& file);

/// What tells this file from every other, also from one that is written anew with the same content.
/// Throws Error as readVolume().
std::string volumeIdentifier(const std::filesystem::path& file);

} // namespace volcomp
