// SPDX-License-Identifier: Apache-2.0
// The shadow that skins throw on the volume.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "volcomp/render/render_params.h"
#include "volcomp/render/skin/skin_shadow_map.h"
#include "volcomp/render/skin/skin_tracer.h"
#include "volcomp/view/light.h"

namespace volcomp {

/// How much of each light passes the skins on its way to places in a volume. Threads share it.
class SkinShadow {
public:
    /// `lights` in world units. With Shadows::sweep it keeps maps, otherwise it sends a ray for
    /// each question. The tracer and the tree must outlive this.
    SkinShadow(const SkinTracer& skins, const VoxelTree& tree, const std::vector<Light>& lights,
               Shadows shadows);

    /// For a place in corner coordinates: 0 in the shadow, 1 outside, and with maps something
    /// between in a border of a voxel.
    double lightAt(std::size_t light, const Vec3d& p) const;

    std::size_t memoryBytes() const; ///< of the maps, which grow as they are asked

private:
    bool isBright(std::size_t light, const Vec3d& p) const;

    const SkinTracer& m_skins;
    const VoxelTree& m_tree;
    const std::vector<Light> m_lights;
    const Shadows m_shadows;
    /// By light; a directional one has only the first, a point light's are counted by 2 x axis + (1
    /// if the light goes towards +).
    std::vector<std::array<std::unique_ptr<const SkinShadowMap>, 6>> m_maps;
};

} // namespace volcomp
