// SPDX-License-Identifier: Apache-2.0
// What one ray sees: the integrals (1) and (2) along it (MODEL section 3), with every voxel shaded.
#pragma once

#include <vector>

#include "volcomp/render/march/march_scene.h"
#include "volcomp/render/march/segment.h"

namespace volcomp {

/// Traces rays through a tree. Threads share it; each call takes the `Scratch` of its thread.
class Integrator {
public:
    using Scratch = RayScratch;

    /// `part_materials` holds the material of each part of the tree. The tree must outlive this.
    Integrator(const VoxelTree& tree, std::vector<Material> part_materials,
               const std::vector<Light>& lights, const RenderParams& params)
        : m_scene(tree, std::move(part_materials), lights, params)
    {
    }

    /// What a ray sees from `origin` along `direction`, world units; the direction has unit length.
    /// A direction that is zero or not finite sees nothing.
    RaySample trace(const Vec3d& origin, const Vec3d& direction, Scratch& scratch) const;
    /// Adds what lies between two distances from `origin`, world units, behind what `sample` has
    /// seen.
    void traceFurther(RaySample& sample, const Vec3d& origin, const Vec3d& direction, double start,
                      double end, Scratch& scratch) const;

    /// Uses swept light instead of rays, if it is known. The sweep must outlive this.
    void useSweep(const ShadowSweep& sweep) { m_scene.sweep = &sweep; }

    /// Lets skins shadow the volume. The shadow must outlive this.
    void useSkinShadow(const SkinShadow& shadow) { m_scene.skin_shadow = &shadow; }

    /// Takes other lights instead of its own: MarchScene::useLights().
    void useLights(const std::vector<Light>& lights, const std::vector<std::size_t>& shadows)
    {
        m_scene.useLights(lights, shadows);
    }

    /// Lets light be scattered more than once, and what comes from all around be blocked. It must
    /// outlive this.
    void useOpenness(const Openness& openness) { m_scene.setOpenness(openness); }

    /// All that rays through the tree share.
    const MarchScene& scene() const { return m_scene; }

    /// Raises the weights of the leaves that the ray reaches between two distances and before the
    /// cutoff, as ShadowSweep wants them: `seen` has one for each leaf, by VoxelTree::place(), the
    /// greatest share of a ray that shows a voxel of it, and becomes longer if the tree does.
    /// `depth` is the optical depth before; returns that behind.
    double markLeaves(const Vec3d& origin, const Vec3d& direction, double from, double to,
                      double depth, std::vector<float>& seen) const;

    /// The optical depth behind which nothing matters.
    double darkest() const { return m_scene.darkest(); }
    /// Optical depth of density 1 over one voxel.
    double extinction() const { return m_scene.extinction; }

    /// Optical depth from p (corner coordinates), in voxel `cell` or on its faces, to a light.
    double depthToLight(std::size_t light, const int* cell, const Vec3d& p_corner,
                        RayCounts& counts) const
    {
        return volcomp::depthToLight(m_scene, light, cell, p_corner, counts);
    }

private:
    MarchScene m_scene;
};

} // namespace volcomp
