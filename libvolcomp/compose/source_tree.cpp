// SPDX-License-Identifier: Apache-2.0
#include "volcomp/compose/source_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "volcomp/base/error.h"

namespace volcomp {

SourceTree::SourceTree(const BoxSources& packed, const PlacedScene& scene,
                       const std::vector<Skin>& skins)
    : m_list(scene.boxes.placements), m_skins(skins)
{
    std::size_t triangles = 0;
    for (const Skin& skin : skins) {
        triangles += skin.surface().mesh().triangles.size();
        // The shell is half a voxel off, see Skin::add(); and a bit for rounding.
        m_skin_spread = std::max(m_skin_spread, skin.reach() + 0.51);
    }
    if (m_list.size() + triangles > std::numeric_limits<std::uint32_t>::max())
        throw Error(
            fmt::format("compose: expected fewer than 2^32 boxes and triangles of skins, found {}",
                        m_list.size() + triangles));
    for (const Pyramids& parts : packed.boxes) m_boxes.push_back(boundsOfBox(parts));
    m_placements = {m_list.size(), [&](std::uint32_t i) { return boundsOfPlacement(i); }};
    m_triangles = {triangles, [&](std::uint32_t t) { return boundsOfTriangle(t); }};
}

SourceTree::BoxBounds SourceTree::boundsOfBox(const Pyramids& parts)
{
    Vec3d low(std::numeric_limits<double>::max()), high(-std::numeric_limits<double>::max());
    for (const Pyramid& levels : parts) {
        const SourcePart& own = levels[0];
        if (own.voxels.empty()) continue;
        const Vec3d centre(own.bounds.centre), half(own.bounds.half);
        low = openvdb::math::minComponent(low, (centre - half) * own.voxel);
        high = openvdb::math::maxComponent(high, (centre + half) * own.voxel);
    }
    if (low[0] > high[0]) return {};
    return {(low + high) * 0.5, (high - low) * 0.5};
}

openvdb::BBoxd SourceTree::boundsOfPlacement(std::uint32_t placement) const
{
    const Placement& p = m_list[placement];
    const BoxBounds& box = m_boxes[p.box];
    if (box.half[0] < 0) return {};
    Vec3d centre = p.position, half(0.0);
    const Vec3f* const axes[3] = {&p.x_axis, &p.y_axis, &p.z_axis};
    for (int a = 0; a < 3; ++a)
        for (int i = 0; i < 3; ++i) {
            const double along = double((*axes[a])[i]) * double(p.scale);
            centre[i] += along * box.centre[a];
            half[i] += std::abs(along) * box.half[a];
        }
    return {centre - half, centre + half};
}

openvdb::BBoxd SourceTree::boundsOfTriangle(std::uint32_t triangle) const
{
    std::size_t in_skin = triangle;
    auto skin = m_skins.begin();
    for (; in_skin >= skin->surface().mesh().triangles.size(); ++skin)
        in_skin -= skin->surface().mesh().triangles.size();
    const Mesh& mesh = skin->surface().mesh();
    openvdb::BBoxd bounds;
    for (const std::int32_t corner : mesh.triangles[in_skin]) bounds.expand(mesh.points[corner]);
    return bounds;
}

openvdb::BBoxd SourceTree::bounds(double voxel) const
{
    openvdb::BBoxd all;
    const auto add = [&](openvdb::BBoxd b, double spread) {
        if (b.min()[0] > b.max()[0]) return;
        const Vec3d margin(spread * voxel);
        all.expand(openvdb::BBoxd(b.min() - margin, b.max() + margin));
    };
    add(m_placements.bounds(), kSpread);
    add(m_triangles.bounds(), m_skin_spread);
    return all;
}

} // namespace volcomp
