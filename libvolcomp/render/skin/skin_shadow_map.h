// SPDX-License-Identifier: Apache-2.0
// Where the rays of a light meet the skins: the shadow of meshes on the volume for swept light, in
// which a ray for each shaded voxel would take as long as all the rest.
//
// The rays are those of a LightLattice, 2/3 voxel apart. For each the map keeps where along the
// light's way it first meets a skin, and how that plane slants. A point lies in the shadow of a ray
// beside it if it is more than kBias voxels below that plane, and the map gives the mean of the
// four rays around it. With the slant alone, planes that the light grazes do not shade themselves.
//
// Patches of 16 x 16 rays are traced when the first point asks for one of them.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "volcomp/base/vec.h"
#include "volcomp/render/shadow/light_lattice.h"
#include "volcomp/render/skin/skin_tracer.h"
#include "volcomp/render/tree/voxel_tree.h"

namespace volcomp {

/// The map of a directional light, or of one of a point light's pyramids. Threads share it; what it
/// holds does not depend on which of them asks first. It can be neither copied nor moved.
class SkinShadowMap {
public:
    static constexpr double kSpacing = 2.0 / 3; ///< between neighbouring rays, voxels
    static constexpr double kBias = 0.5;        ///< across the plane, voxels

    /// For points in the tree's bounds. `rays` begin at the light; those of a fan have no spacing
    /// yet. The tracer and the tree must outlive this.
    SkinShadowMap(const SkinTracer& skins, const VoxelTree& tree, const LightLattice& rays);
    ~SkinShadowMap();
    SkinShadowMap(const SkinShadowMap&) = delete;
    SkinShadowMap& operator=(const SkinShadowMap&) = delete;

    /// How much of the light passes the skins on its way to `p` (corner coordinates), 0 to 1.
    /// Nothing if the map has no rays there: outside of the bounds and of a fan.
    std::optional<double> lightAt(const Vec3d& p) const;

    std::size_t memoryBytes() const { return m_bytes.load(); }

private:
    static constexpr int kStep = 16,
                         kSide = kStep + 1; ///< rays of a patch; the last are the next's
    static constexpr int kBlock = 32;       ///< patches along an edge of a block
    /// Where a ray meets a skin, s of LightLattice, how that grows from ray to ray, and how much of
    /// s leads through kBias.
    struct Ray {
        float s, per_u, per_v, bias;
    };
    struct Patch {
        double first; ///< the least s at which something is dark, or less
        std::array<Ray, kSide * kSide> rays;
    };
    struct Block {
        std::array<std::atomic<const Patch*>, kBlock * kBlock> patches{};
    };

    const Patch& patchAt(int u, int v) const;
    const Patch* trace(int u, int v, std::atomic<const Patch*>& place) const;
    Ray rayAt(double u, double v) const;

    const SkinTracer& m_skins;
    const VoxelTree& m_tree;
    LightLattice m_lattice;
    double m_per_spacing = 1;                    ///< 1 / spacing, of parallel rays
    double m_first_s = 0;                        ///< of the bounds
    int m_low[2] = {0, 0}, m_high[2] = {-1, -1}; ///< patches along u and v, bounds included
    int m_columns = 0;                           ///< blocks along v
    mutable std::vector<std::atomic<Block*>> m_blocks;
    mutable std::atomic<std::size_t> m_bytes{0};
    Patch m_bright; ///< stands for all patches that meet nothing
};

} // namespace volcomp
