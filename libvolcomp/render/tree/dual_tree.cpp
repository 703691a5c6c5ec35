#include "volcomp/render/tree/dual_tree.h"

#include <cstring>

namespace volcomp {

DualTree::DualTree(const VoxelTree& tree)
    : m_tree(tree), m_gathered([this] { return Gathered(*this); })
{
    std::vector<openvdb::Coord> origins;
    tree.forEachCell([&](const openvdb::Coord& origin,
                         int) { // a leaf's centres are corners of its own cells and of those below
        for (int k = 0; k < 8; ++k) {
            const openvdb::Coord o =
                origin.offsetBy(-8 * (k >> 2), -8 * (k >> 1 & 1), -8 * (k & 1));
            const auto [block, fresh] = m_blocks.emplace(
                openvdb::Coord(o[0] >> 7, o[1] >> 7, o[2] >> 7), int(m_blocks.size()));
            if (fresh) m_children.resize(m_children.size() + 4096, VoxelTree::kEmpty);
            std::int32_t& child =
                m_children[std::size_t(block->second) * 4096
                           + ((o[0] >> 3 & 15) << 8 | (o[1] >> 3 & 15) << 4 | (o[2] >> 3 & 15))];
            if (child != VoxelTree::kEmpty) continue;
            child = std::int32_t(origins.size());
            origins.push_back(o);
            m_bounds.expand(openvdb::CoordBBox(o, o.offsetBy(kLeafDim - 1)));
        }
    });
    m_leaves.resize(origins.size());
    for (std::size_t i = 0; i < origins.size(); ++i)
        for (int k = 0; k < 8; ++k)
            m_leaves[i][k] =
                tree.leafAt(origins[i][0] + 8 * (k >> 2), origins[i][1] + 8 * (k >> 1 & 1),
                            origins[i][2] + 8 * (k & 1));
}

void DualTree::gather(int leaf, float* values) const
{
    static constexpr float kNothing[512] = {};
    const float* densities[8];
    for (int k = 0; k < 8; ++k)
        densities[k] =
            m_leaves[leaf][k] == VoxelTree::kEmpty ? kNothing : m_tree.densities(m_leaves[leaf][k]);
    for (int x = 0; x < kDim; ++x)
        for (int y = 0; y < kDim; ++y, values += kDim) {
            const int k = (x >> 3) << 2 | (y >> 3) << 1, row = (x & 7) << 6 | (y & 7) << 3;
            std::memcpy(values, densities[k] + row, kLeafDim * sizeof(float));
            values[kLeafDim] = densities[k + 1][row];
        }
}

void DualTree::Gathered::allocate()
{
    m_at.assign(std::size_t(1) << kBits, VoxelTree::kEmpty);
    m_values.reset(new float[std::size_t(kStride) << kBits]); // memory is taken as it is used
}

} // namespace volcomp
