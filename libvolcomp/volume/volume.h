// SPDX-License-Identifier: Apache-2.0
// Voxels that can be rendered: what a box file and a composed volume file both hold.
//
// A Volume is a list of parts, one for each material; where parts overlap, their densities add and
// their radiances mix by density (MODEL section 8). All grids of all parts share one linear
// transform with cubic voxels. A voxel (i,j,k) reaches half a voxel to each side of its centre,
// which is the point (i,j,k) of index space. Inactive voxels hold 0.
//
// A program calls openvdb::initialize() once, before it makes, reads or writes a volume.
#pragma once

#include <string>
#include <vector>

#include <openvdb/openvdb.h>

#include "volcomp/volume/material.h"
#include "volcomp/base/vec.h"

namespace volcomp {

/// The grids of one material. A copy shares them.
struct VolumePart {
    std::string material; ///< name of the material; empty if a foreign file names none
    MaterialKind kind = MaterialKind::fibre;
    openvdb::FloatGrid::Ptr density; ///< 1 / world length, finite, >= 0; never null

    /// Tangent (fibre) or normal (surface), world space (box space in a box), sign free. Its length
    /// is 1 - s. Here s = sqrt((l2 + l3) / (2 l1)) is the spread of the directions that were summed
    /// in the voxel, with the eigenvalues l1 >= l2 >= l3 of the density-weighted sum of t tᵀ (MODEL
    /// section 8). So the length is 1 if all agree, and 0 if there is no direction. Null: no voxel
    /// has a direction.
    openvdb::Vec3SGrid::Ptr direction;

    /// Diffuse colour c_b, linear RGB. Null: uniform_colour everywhere.
    openvdb::Vec3SGrid::Ptr colour;
    Vec3f uniform_colour{1.0f};

    /// The share of a voxel's density that belongs to the same strand or leaf as a particle, mean
    /// over its particles: sum rho_k^2 / (sum rho_k)^2 over the strands, 1 / their number if they
    /// are equal (MODEL section 2). In a composed volume it is times what of it a leaf's light
    /// leaves out (MODEL section 3). 0 to 1. Null: 0 everywhere, as in fog.
    openvdb::FloatGrid::Ptr own_share;

    /// The light that a voxel which stands for eight scatters once, over that of a homogeneous
    /// voxel of the same density and own share, if the light comes from the side of the eye, from
    /// across, and from behind (MODEL section 8). Coarser levels have it, and volumes composed of
    /// boxes that were made coarser. Null: 1 everywhere.
    openvdb::Vec3SGrid::Ptr scatter_ratio;
};

/// A box or a composed volume: one part for each material, all with the same transform. A copy
/// shares the grids: a change of a voxel shows in both.
struct Volume {
    std::vector<VolumePart> parts;
    /// What was mended or left out when the volume was read, a sentence each, with the file's name.
    std::vector<std::string> warnings{};

    /// Edge of a voxel, world units. Throws std::out_of_range if there are no parts.
    double voxelSize() const { return parts.at(0).density->voxelSize()[0]; }
};

/// A density below 0, but above -kTinyNegative times the largest one, is what filters leave behind:
/// it counts as 0, with a warning. One below that is an error.
constexpr float kTinyNegative = 1e-6f;

/// That warning, without the name of the file.
std::string negativeDensities(const std::string& grid, float least);

/// The density grid, with voxels instead of active tiles; itself if it has none. Throws Error if
/// the tiles hold more than 2^27 voxels.
openvdb::FloatGrid::ConstPtr withoutActiveTiles(const openvdb::FloatGrid::ConstPtr& density);

/// A volume box (MODEL section 6): root at the origin, axis +Y, in metres. A copy shares the grids.
struct Box {
    std::string name;
    int variant = 0; ///< from 0 on; names of files count from 1
    Volume volume;
};

} // namespace volcomp
