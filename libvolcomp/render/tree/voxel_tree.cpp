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

void VoxelTree::countBefore(Leaf& leaf)
{
    for (int w = 1; w < 8; ++w)
        leaf.before[w] = std::uint16_t(leaf.before[w - 1] + __builtin_popcountll(leaf.mask[w - 1]));
}

void VoxelTree::finish(const std::vector<std::uint64_t>& uses)
{
    for (std::size_t i = 0; i < m_leaves.size(); ++i) {
        const Leaf& l = m_leaves[i];
        m_voxel_count +=
            uses[i] * (l.uniform ? kLeafSize : l.before[7] + __builtin_popcountll(l.mask[7]));
        m_directed |= l.directed;
    }
    for (const float density : m_density) m_max_density = std::max(m_max_density, density);
}

Vec3d VoxelTree::toCorner(const Vec3d& p) const { return m_rotation * (p - m_origin) / m_voxel; }

std::size_t VoxelTree::memoryBytes() const
{
    return m_places.memoryBytes() + m_leaves.size() * sizeof(Leaf)
        + m_density.size() * sizeof(float) + m_records.size() * sizeof(VoxelRecord)
        + m_shared.size() * sizeof(Shared) + m_scatter_ratio.size() * sizeof(ScatterRatio);
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
    const Shared* entry = &m_shared[record.listStart()];
    for (const Shared* end = entry + record.listCount(); entry != end; ++entry) {
        sum += entry->density;
        weighted += entry->density * recordFactor(entry->record, entry->part, d);
    }
    return weighted / sum;
}

} // namespace volcomp
