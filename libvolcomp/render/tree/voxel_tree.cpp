// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/tree/voxel_tree.h"

#include <algorithm>
#include <cmath>

#include "volcomp/base/error.h"

namespace volcomp {

VoxelTree::VoxelTree(const Volume& volume) : VoxelTree(VolumeSource(volume)) { }

void VoxelTree::setTransform(const openvdb::math::Transform& transform)
{
    m_voxel = transform.voxelSize()[0];
    Vec3d axes[3];
    const Vec3d zero = transform.indexToWorld(Vec3d(0.0));
    for (int a = 0; a < 3; ++a) {
        Vec3d e(0.0);
        e[a] = 1;
        axes[a] = (transform.indexToWorld(e) - zero) / m_voxel;
    }
    for (int a = 0; a < 3; ++a)
        if (!transform.isLinear() || !(m_voxel > 0)
            || !(std::abs(axes[a].length() - 1) < 1e-6
                 && std::abs(axes[a].dot(axes[(a + 1) % 3])) < 1e-6))
            throw Error(
                "the volume's voxels are not cubes (a non-uniform, sheared or perspective transform); resample it with uniform scale");
    m_rotation.setRows(axes[0], axes[1], axes[2]);
    m_origin = transform.indexToWorld(Vec3d(-0.5));
}

VoxelTree::VoxelTree(std::shared_ptr<const TileMaker> maker, std::shared_ptr<TileBudget> budget)
{
    for (const PartInfo& part : maker->parts()) {
        m_parts.push_back({part.material, part.kind});
        m_directed |= part.has_direction;
    }
    setTransform(maker->transform());
    m_bounds = maker->bounds();
    m_tiles = std::make_unique<TileStore>(std::move(maker), std::move(budget));
    m_at = m_tiles->tables();
}

void VoxelTree::finish(const std::vector<std::uint64_t>& uses)
{
    for (std::size_t i = 0; i < m_leaves.size(); ++i) {
        const Leaf& l = m_leaves[i];
        m_voxel_count += uses[i] * std::uint64_t(l.uniform ? kLeafSize : l.count());
        m_directed |= l.directed;
    }
    for (const float density : m_density) m_max_density = std::max(m_max_density, density);
    m_at = {m_leaves.data(), m_density.data(), m_records.data(), m_listed.data(),
            m_scatter_ratio.empty() ? nullptr : m_scatter_ratio.data()};
}

std::uint64_t VoxelTree::voxelCount() const
{
    return m_tiles ? m_tiles->voxelCount() : m_voxel_count;
}

std::size_t VoxelTree::leafCount() const
{
    return m_tiles ? m_tiles->leafCount() : m_leaves.size();
}

Vec3d VoxelTree::toCorner(const Vec3d& p) const { return m_rotation * (p - m_origin) / m_voxel; }

std::size_t VoxelTree::memoryBytes() const
{
    if (m_tiles) return m_tiles->memoryBytes();
    return m_places.memoryBytes() + m_leaves.size() * sizeof(Leaf)
        + m_density.size() * sizeof(float) + m_records.size() * sizeof(VoxelRecord)
        + m_listed.size() * sizeof(ListedRecord) + m_scatter_ratio.size() * sizeof(ScatterRatio);
}

double VoxelTree::directionFactor(const VoxelContent& content, const Vec3d& d) const
{
    if (!content.directed) return 1;
    return m_direction_factors.at(m_parts[content.part].kind, content.spread_code,
                                  content.direction.dot(d));
}

double VoxelTree::sharedFactor(const VoxelRecord& record, const Vec3d& d) const
{
    double sum = 0, weighted = 0;
    const ListedRecord* entry = m_at.listed + record.listStart();
    for (const ListedRecord* end = entry + record.listCount(); entry != end; ++entry) {
        sum += entry->density;
        weighted += entry->density * recordFactor(entry->record, entry->part, d);
    }
    return weighted / sum;
}

} // namespace volcomp
