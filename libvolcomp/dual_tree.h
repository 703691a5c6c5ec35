// The volume for the trilinear filter: cells between eight voxel centres, in blocks of 8^3 cells with the 9^3 densities they need.
//
// Coordinates are VoxelTree's corner coordinates less half a voxel: cell (i,j,k) is [i,i+1)^3 and its corners are the centres of the voxels
// (i,j,k) to (i+1,j+1,k+1). The class offers what forEachLeaf() and MarchRay ask of a tree.
#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "voxel_tree.h"

namespace volcomp {

/// The tree of the cells between voxel centres; walked as a VoxelTree is.
class DualTree {
public:
    static constexpr int kDim = kLeafDim + 1; ///< densities along an edge of a block

    explicit DualTree(const VoxelTree& tree);

    bool empty() const { return m_values.empty(); }
    const openvdb::CoordBBox& bounds() const { return m_bounds; }
    int block(int x, int y, int z) const
    {
        const auto at = m_blocks.find(openvdb::Coord(x >> 7, y >> 7, z >> 7));
        return at == m_blocks.end() ? VoxelTree::kEmpty : at->second;
    }
    int leafIn(int block, int x, int y, int z) const
    {
        return m_children[std::size_t(block) * 4096 + ((x >> 3 & 15) << 8 | (y >> 3 & 15) << 4 | (z >> 3 & 15))];
    }

    /// The eight densities of a cell, offset as VoxelTree::offset(): corner (x,y,z) is corners[4 x + 2 y + z]. False where all are 0.
    bool corners(int leaf, int cell, float* corners) const
    {
        const float* v = &m_values[std::size_t(leaf) * kDim * kDim * kDim + ((cell >> 6) * kDim + (cell >> 3 & 7)) * kDim + (cell & 7)];
        float sum = 0;
        for (int k = 0; k < 8; ++k) sum += corners[k] = v[((k >> 2) * kDim + (k >> 1 & 1)) * kDim + (k & 1)];
        return sum > 0;
    }
    std::size_t memoryBytes() const { return m_values.size() * sizeof(float) + m_children.size() * sizeof(std::int32_t); }

private:
    openvdb::CoordBBox m_bounds;
    std::unordered_map<openvdb::Coord, int> m_blocks;
    std::vector<std::int32_t> m_children;
    std::vector<float> m_values;
};

/// The integrals over t from t0 to t1 of the eight trilinear weights along the ray o + t d, from the cell's lowest corner. They are cubic
/// in t, so two Gauss-Legendre points are exact.
inline void cornerWeights(const double* o, const double* d, const int* cell, double t0, double t1, double* weights)
{
    const double middle = 0.5 * (t0 + t1), half = 0.5 * (t1 - t0), reach = half * 0.57735026918962576451;
    for (int k = 0; k < 8; ++k) weights[k] = 0;
    for (const double t : {middle - reach, middle + reach}) {
        const double x = o[0] + d[0] * t - cell[0], y = o[1] + d[1] * t - cell[1], z = o[2] + d[2] * t - cell[2];
        const double wx[2] = {half * (1 - x), half * x}, wy[2] = {1 - y, y}, wz[2] = {1 - z, z};
        for (int k = 0; k < 8; ++k) weights[k] += wx[k >> 2] * wy[k >> 1 & 1] * wz[k & 1];
    }
}

} // namespace volcomp
