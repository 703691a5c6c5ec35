// What one ray sees: the integrals (1) and (2) along it (MODEL section 3), with every voxel shaded.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "volcomp/render/tree/dual_tree.h"
#include "volcomp/view/light.h"
#include "volcomp/render/march/march.h"
#include "volcomp/volume/material.h"
#include "volcomp/render/render_params.h"
#include "volcomp/render/shade.h"
#include "volcomp/render/shadow/shadow_sweep.h"
#include "volcomp/render/tree/voxel_tree.h"

namespace volcomp {

/// What a ray brings.
struct RaySample {
    Vec3d radiance{0.0};      ///< of the volume alone, the background not added
    double transmittance = 1; ///< to the ray's end
    // With RenderParams::aovs, weighted by what each voxel shows of itself:
    Vec3d albedo{0.0}, normal{0.0}; ///< alpha c_b; direction, turned to the eye
    double depth = 0;               ///< distance from the ray's origin, world units
};

/// How much work a render was.
struct RayCounts {
    std::uint64_t rays = 0, shadow_rays = 0, shaded_voxels = 0;
};

/// Traces rays through a tree. Shared by threads; each call with its own `Scratch`.
class Integrator {
public:
    /// `part_materials` holds the material of each part of the tree. The references must outlive
    /// this.
    Integrator(const VoxelTree& tree, std::vector<Material> part_materials,
               const std::vector<Light>& lights, const RenderParams& params);

    /// Of one light along a ray.
    struct LightState {
        Vec3d S{
            0.0}; ///< its strength, falloff and the voxel's reflection, without what lies between
        double depth = 0, t = -1; ///< optical depth from the ray's point at t to the light
        double passes = 0, rough_t = -1e30; ///< light that passes to the point at rough_t, roughly
        bool fine = false, lit = false;
    };
    /// What a thread keeps between the voxels of a ray.
    struct Scratch {
        std::vector<LightState> lights;
        RayCounts counts;
        Vec3d albedo{0.0}, normal{0.0};    ///< of the voxel at hand
        std::vector<Vec3d> light_radiance; ///< of each light, summed over the ray; with aovs
    };

    /// Both in world units; the direction is unit length. Zero or non-finite directions see
    /// nothing.
    RaySample trace(const Vec3d& origin, const Vec3d& direction, Scratch& scratch) const;
    /// Adds what lies between two distances, world units, behind what `sample` has seen.
    void traceFurther(RaySample& sample, const Vec3d& origin, const Vec3d& direction, double start,
                      double end, Scratch& scratch) const;

    /// Uses swept light instead of rays, where it is known. The reference must outlive this.
    void useSweep(const ShadowSweep& sweep) { m_sweep = &sweep; }

    /// Raises the weights of the leaves that the ray reaches between two distances and before the
    /// cutoff, as ShadowSweep wants them.
    void markLeaves(const Vec3d& origin, const Vec3d& direction, double from, double to,
                    std::vector<float>& seen) const;
    /// The optical depth behind which nothing matters.
    double darkest() const { return m_params.cutoff > 0 ? -std::log(m_params.cutoff) : 12; }

    double extinction() const { return m_extinction; }

    /// Optical depth from p, in voxel `cell` or on its faces, to a light: swept where that is used
    /// and known, else along a ray.
    double depthToLight(std::size_t light, const int* cell, const Vec3d& p_corner,
                        RayCounts& counts) const;

private:
    template <bool kFibre>
    void traceExact(RaySample& sample, const MarchRay& r, const Vec3d& direction,
                    Scratch& scratch) const;
    void traceTrilinear(RaySample& sample, const MarchRay& r, const Vec3d& direction,
                        Scratch& scratch) const;
    template <class Tree>
    void traceSums(RaySample& sample, const Tree& tree, const MarchRay& r, double shift,
                   const Vec3d& direction, Scratch& scratch) const;
    template <class Tree>
    double sumDepth(const Tree& tree, const MarchRay& r, const Vec3d& d_world) const;
    double trilinearDepth(const MarchRay& r, const Vec3d& d_world) const;
    void addSegment(RaySample& sample, const Vec3d& ambient, double delta, const int* cell,
                    const Vec3d& p, const Vec3d& q, double t, double end, Scratch& scratch) const;
    bool addRoughly(RaySample& sample, std::size_t light, double opacity, const int* cell,
                    const Vec3d& middle, double t, Scratch& scratch) const;
    Vec3d toLight(std::size_t light, const Vec3d& p, double& distance) const;
    void addAovs(RaySample& sample, double weight, double t, Scratch& scratch) const;
    void addLight(RaySample& sample, std::size_t light, const Vec3d& source,
                  Scratch& scratch) const;
    void startShading(Scratch& scratch, Vec3d& ambient) const;
    void shade(int leaf, int voxel, const int* cell, double share, const Vec3d& p_corner,
               const Vec3d& V, Scratch& scratch, Vec3d& ambient) const;
    double effectiveDensity(int x, int y, int z, const Vec3d& d_world) const;
    double effectiveDensity(const DualTree::Corner& corner, float density,
                            const Vec3d& d_world) const;
    /// Optical depth along the ray with the filter and the method at hand, in the coordinates of
    /// its tree; stops where it is dark.
    double depthAlong(const MarchRay& r, const Vec3d& d_world) const;
    Vec3d gradientNormal(const int* cell) const;

    const VoxelTree& m_tree;
    std::shared_ptr<const DualTree> m_dual; ///< for the trilinear filter
    const ShadowSweep* m_sweep = nullptr;
    bool m_fibre;     ///< fibre extinction matters
    bool m_transmits; ///< nothing shines and nothing else is asked for: rays bring their
                      ///< transmittance alone
    std::vector<Material> m_materials;
    const std::vector<Light>& m_lights;
    std::vector<Light> m_corner_lights; ///< position in corner coordinates, direction in grid axes
    std::vector<MarchRay> m_light_rays; ///< towards the directional ones
    RenderParams m_params;
    std::vector<Lobe> m_lobes; ///< 64 a part, by spread code
    double m_extinction;       ///< optical depth of density 1 over one voxel
    double m_stop;             ///< of line integrals
};

/// (1 - e^-x) / x e^-a without overflow, 1 at x = 0: the light of a segment whose optical depth to
/// the light goes linearly from a to a + x - delta.
double segmentLight(double a, double x);

} // namespace volcomp
