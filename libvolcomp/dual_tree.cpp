#include "dual_tree.h"

#include <algorithm>

#include <tbb/parallel_for.h>

namespace volcomp {

DualTree::DualTree(const VoxelTree& tree)
{
    std::vector<openvdb::Coord> origins; // a leaf's centres are corners of its own cells and of those below
    tree.forEachCell([&](const openvdb::Coord& origin, int) {
        for (int k = 0; k < 8; ++k) origins.push_back(origin.offsetBy(-8 * (k >> 2), -8 * (k >> 1 & 1), -8 * (k & 1)));
    });
    std::sort(origins.begin(), origins.end());
    origins.erase(std::unique(origins.begin(), origins.end()), origins.end());
    m_values.resize(origins.size() * kDim * kDim * kDim);
    for (std::size_t i = 0; i < origins.size(); ++i) {
        const openvdb::Coord& o = origins[i];
        const auto [at, fresh] = m_blocks.emplace(openvdb::Coord(o[0] >> 7, o[1] >> 7, o[2] >> 7), int(m_blocks.size()));
        if (fresh) m_children.resize(m_children.size() + 4096, VoxelTree::kEmpty);
        m_children[std::size_t(at->second) * 4096 + ((o[0] >> 3 & 15) << 8 | (o[1] >> 3 & 15) << 4 | (o[2] >> 3 & 15))] = std::int32_t(i);
        m_bounds.expand(openvdb::CoordBBox(o, o.offsetBy(kLeafDim - 1)));
    }
    tbb::parallel_for(std::size_t(0), origins.size(), [&](std::size_t i) {
        const openvdb::Coord& o = origins[i];
        int leaves[8];
        for (int k = 0; k < 8; ++k) leaves[k] = tree.leafAt(o[0] + 8 * (k >> 2), o[1] + 8 * (k >> 1 & 1), o[2] + 8 * (k & 1));
        float* v = &m_values[i * kDim * kDim * kDim];
        for (int x = 0; x < kDim; ++x)
            for (int y = 0; y < kDim; ++y)
                for (int z = 0; z < kDim; ++z, ++v) {
                    const int leaf = leaves[(x >> 3) << 2 | (y >> 3) << 1 | z >> 3];
                    *v = leaf == VoxelTree::kEmpty ? 0 : tree.densities(leaf)[VoxelTree::offset(x, y, z)];
                }
    });
}

} // namespace volcomp
