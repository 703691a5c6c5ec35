// Volumes in VDB files that other programs understand: fog volumes named `density`, `tangentu` or `N`, and `Cd`.
//
// A volume of one material has those names; with several, each part's grids carry the material's name behind an underscore
// (`density_bark`, `N_bark`, `Cd_bark`) and `density` is their sum. A colour that is the same everywhere is not a grid but
// metadata of the density grid. Each part's density grid names its material in the metadata `volcomp_material`.
#pragma once

#include <filesystem>

#include "volume.h"

namespace volcomp {

/// Writes the volume; the file appears under its name when it is complete. `extra` is added to the file's metadata.
/// Throws Error where the file cannot be written.
void writeVolume(const std::filesystem::path& file, const Volume& volume, const openvdb::MetaMap& extra = {});

/// Reads a volume, also one that no tool of ours made (a lone `density` grid is enough).
/// Throws Error for a missing, truncated or foreign file, a grid of the wrong type, a transform that is not uniform scale,
/// and NaN, infinite or negative densities.
Volume readVolume(const std::filesystem::path& file);

} // namespace volcomp
