// SPDX-License-Identifier: Apache-2.0
#include "volcomp/compose/voxel_tint.h"

namespace volcomp {

TintWalk::TintWalk(const VoxelTint& tint)
    : m_tint(tint),
      m_by_mesh(tint.colour->usesUv() && tint.surface->projection().kind == ProjectionKind::uv),
      m_triangle(tint.triangle)
{
    if (static_cast<std::size_t>(tint.triangle) >= tint.surface->mesh().triangles.size())
        m_triangle = -1;
}

Vec3f TintWalk::at(const Vec3d& world)
{
    const SecondDensity& map = *m_tint.colour;
    if (!map.usesUv()) return map.colour({0.0, 0.0}, world);
    return map.colour(m_by_mesh ? m_tint.surface->uvNear(world, m_triangle)
                                : m_tint.surface->projection().project(world),
                      world);
}

} // namespace volcomp
