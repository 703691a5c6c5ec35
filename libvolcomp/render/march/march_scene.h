// SPDX-License-Identifier: Apache-2.0
// What all rays through one tree share: the volume, its materials, the lights and the settings,
// with everything that is worked out of them once.
#pragma once

#include <memory>
#include <vector>

#include "volcomp/render/march/march.h"
#include "volcomp/render/march/sky_light.h"
#include "volcomp/render/render_params.h"
#include "volcomp/render/shade.h"
#include "volcomp/render/shadow/shadow_sweep.h"
#include "volcomp/render/sky/openness.h"
#include "volcomp/render/tree/dual_tree.h"
#include "volcomp/render/tree/voxel_tree.h"
#include "volcomp/view/light.h"
#include "volcomp/volume/material.h"

namespace volcomp {

class SkinShadow;

/// A copy shares the tree, the dual tree and the sweep, and owns the rest. Nothing in it changes
/// while rays are traced, so threads share it.
struct MarchScene {
    /// `part_materials` holds the material of each part of the tree. The tree must outlive this;
    /// the lights, in world units, are copied.
    MarchScene(const VoxelTree& tree, std::vector<Material> part_materials,
               const std::vector<Light>& lights, const RenderParams& params);

    /// The lobe of a part at the spread with this code (VoxelContent::spread_code).
    const Lobe& lobe(int part, int spread_code) const { return lobes[part * 64 + spread_code]; }

    /// Takes other lights, as many, instead of those that it has. `shadows` holds for each its
    /// number in the sweep and in the skins' shadow.
    void useLights(const std::vector<Light>& lights, const std::vector<std::size_t>& shadows);

    /// The optical depth behind which nothing matters.
    double darkest() const;
    /// The same on the way to a light: light that is scattered more than once goes deeper.
    double darkestToLight() const;

    /// Whether anything comes from all around: RenderParams::ambient or its dome.
    bool hasSky() const { return !params.dome.black() || params.ambient != Vec3d(0.0); }
    /// Whether light is scattered more than once.
    bool bounces() const { return openness && params.scattering == Scattering::multiple; }
    /// Whether the settings ask for setOpenness(); without, light is scattered once and what comes
    /// from all around is not blocked.
    bool wantsOpenness() const;
    /// It must outlive this.
    void setOpenness(const Openness& the_openness) { openness = &the_openness; }

    const VoxelTree& tree;
    std::shared_ptr<const DualTree> dual; ///< set if and only if the filter is trilinear
    const ShadowSweep* sweep = nullptr;   ///< swept light, or nullptr if rays are to find all light
    const SkinShadow* skin_shadow = nullptr; ///< of the skins on the volume, or nullptr: none
    const Openness* openness = nullptr;      ///< of the volume and the skins, or nullptr
    SkyTable sky;                            ///< with hasSky()
    RenderParams params;
    std::vector<Material> materials;  ///< by part
    std::vector<Lobe> lobes;          ///< 64 for each part, see lobe()
    std::vector<Light> lights;        ///< world units
    std::vector<Light> grid_lights;   ///< the same: positions in corner coordinates, directions in
                                      ///< the grid's axes
    std::vector<MarchRay> light_rays; ///< for each light: a ray against the light's direction, for
                                      ///< MarchRay::from(); of use for directional lights only
    std::vector<std::size_t> shadow_of; ///< by light: its number in `sweep` and `skin_shadow`
    bool directed;                      ///< extinction depends on the ray's direction somewhere
    bool transmits_only; ///< nothing shines and no other output is wanted: rays need to bring only
                         ///< their transmittance
    double extinction;   ///< optical depth of density 1 over one voxel
    double stop;         ///< a line integral (density x voxels) above this lets no light through
                         ///< that matters, darkestToLight(); infinite if RenderParams::cutoff is 0
};

} // namespace volcomp
