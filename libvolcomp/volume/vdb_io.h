// SPDX-License-Identifier: Apache-2.0
// Volumes in VDB files that other programs understand: fog volumes named `density`, `tangentu` or
// `N`, and `Cd` (or `color`).
//
// A volume of one material has those names. With several, the names of each part's grids end in an
// underscore and the material (`density_bark`, `N_bark`, `Cd_bark`), and a further grid `density`
// is their sum, for other programs. A further grid `own_share` says how few strands a voxel holds
// (VolumePart::own_share). A direction, colour, scatter ratio or own share that is the same in all
// voxels is not a grid but metadata of the part's density grid. That metadata:
//
//     volcomp_material        name of the part's material
//     volcomp_kind            "fibre" or "surface"
//     volcomp_colour          the colour of every voxel, if there is no colour grid
//     volcomp_direction       the direction of every voxel, if there is no direction grid
//     volcomp_scatter_ratio   the scatter ratio of every voxel, if there is no such grid
//     volcomp_own_share       the own share of every voxel, if there is no such grid
//
// Files of coarser levels (voxel_levels.h), and of volumes composed of boxes that were made
// coarser, have one more grid for each part, `scatter_ratio`: VolumePart::scatter_ratio.
//
// A grid is stored as half floats if all of its values are in their range: an error of at most
// 2^-11 of each value. Directions keep the spread of MODEL section 8 in their length (volume.h).
//
// Before any of these functions is called, the program calls openvdb::initialize() once.
#pragma once

#include <filesystem>
#include <string>

#include "volcomp/base/words.h"
#include "volcomp/volume/packed_volume.h"

namespace volcomp {

/// Whose names the grids of a file have. Only the colour differs; all are read.
enum class GridNames {
    houdini, ///< `Cd`
    blender  ///< `color`
};
constexpr Word<GridNames> kGridNamesWords[] = {{"houdini", GridNames::houdini},
                                               {"blender", GridNames::blender}};

/// Writes a volume; the file appears under its name when it is complete. `extra` is added to the
/// file's metadata. Active tiles become voxels, and values of inactive voxels are dropped. Leaves
/// are compressed in parallel; their bytes do not depend on the number of threads. Throws Error if
/// the file cannot be written or the volume has no parts.
void writeVolume(const std::filesystem::path& file, const PackedVolume& volume,
                 const openvdb::MetaMap& extra = {}, GridNames names = GridNames::houdini);
void writeVolume(const std::filesystem::path& file, const Volume& volume,
                 const openvdb::MetaMap& extra = {}, GridNames names = GridNames::houdini);

/// Reads a volume, also one that another program made: a lone `density` grid is enough; directions
/// in such a file are normalised. `grid` names another float grid as the density ("fog",
/// "density[1]"). Voxels of any affine transform that are not cubes along the axes become such
/// (cubic_voxels.h). Densities that are a little below 0 (kTinyNegative) become 0, directions and
/// colours that are not finite become 0.
///
/// With `delayed`, leaves are read from the file when they are first touched, values are not
/// checked here but left to the caller, and a direction that is the same everywhere is the
/// background of a grid without leaves. That does not hold for voxels that are no cubes.
///
/// All lengths, counts and positions in the file are checked before OpenVDB reads it. The first
/// call makes OpenVDB forget its metadata type `__delayedload`, which it trusts.
///
/// Throws Error for a missing, truncated or damaged file, one older than OpenVDB 2.0, a grid of the
/// wrong type or name, a perspective transform, and for densities that are not finite or negative.
Volume readVolume(const std::filesystem::path& file, bool delayed = false,
                  const std::string& grid = {});

/// The metadata of the file itself, not of its grids: what writeVolume() was given as `extra`, and
/// more. Throws Error as readVolume().
openvdb::MetaMap readVolumeMetadata(const std::filesystem::path& file);

/// A text that follows from the content of a file that writeVolume() wrote, and so is the same for
/// one that was made again. Other programs' files have their own each time they are written. With
/// another `grid` as the density it is another text. Throws Error as readVolume().
std::string volumeIdentifier(const std::filesystem::path& file, const std::string& grid = {});

} // namespace volcomp
