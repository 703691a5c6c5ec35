// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/tree/dual_tree.h"

#include <algorithm>

namespace volcomp {
namespace {

// The neighbour number k, 4 x + 2 y + z, of a place of 8^3 voxels: `sign` 1 above, -1 below.
openvdb::Coord neighbour(const openvdb::Coord& place, int k, int sign)
{
    const int step = sign * kLeafDim;
    return place.offsetBy(step * (k >> 2), step * (k >> 1 & 1), step * (k & 1));
}

} // namespace

DualTree::DualTree(const VoxelTree& tree)
    : m_tree(tree), m_gathered([this] { return Gathered(*this); })
{
    // The centres of a leaf's voxels are corners of its own cells and of those below.
    std::vector<openvdb::Coord> origins;
    tree.forEachCell([&](const openvdb::Coord& origin, int) {
        for (int k = 0; k < 8; ++k) {
            const openvdb::Coord o = neighbour(origin, k, -1);
            if (m_places.leafAt(o[0], o[1], o[2]) != VoxelTree::kEmpty) continue;
            m_places.setLeaf(o, int(origins.size()));
            origins.push_back(o);
            m_bounds.expand(openvdb::CoordBBox(o, o.offsetBy(kLeafDim - 1)));
        }
    });
    m_leaves.resize(origins.size());
    for (std::size_t i = 0; i < origins.size(); ++i)
        for (int k = 0; k < 8; ++k) {
            const openvdb::Coord o = neighbour(origins[i], k, 1);
            m_leaves[i][k] = tree.leafAt(o[0], o[1], o[2]);
        }
}

void DualTree::gather(int leaf, float* values) const
{
    std::fill_n(values, kValues, 0.0f);
    for (int k = 0; k < 8; ++k) {
        if (m_leaves[leaf][k] == VoxelTree::kEmpty) continue;
        const LeafDensities densities = m_tree.densities(m_leaves[leaf][k]);
        // Of the leaves beside, only the voxels at the face, edge or corner.
        const int dx = k >> 2, dy = k >> 1 & 1, dz = k & 1;
        for (int x = 0; x < (dx ? 1 : kLeafDim); ++x)
            for (int y = 0; y < (dy ? 1 : kLeafDim); ++y)
                for (int z = 0; z < (dz ? 1 : kLeafDim); ++z)
                    values[((x + dx * kLeafDim) * kDim + y + dy * kLeafDim) * kDim + z
                           + dz * kLeafDim] = densities[VoxelTree::offset(x, y, z)];
    }
}

void DualTree::Gathered::allocate()
{
    m_at.assign(std::size_t(1) << kBits, VoxelTree::kEmpty);
    m_values.reset(new float[std::size_t(kStride) << kBits]); // not touched before it is used
}

} // namespace volcomp
