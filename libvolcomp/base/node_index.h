// SPDX-License-Identifier: Apache-2.0
// How the lowest two levels of an OpenVDB tree are numbered: leaves of 8^3 voxels, and nodes of
// 16^3 leaves. Numbers run with z fastest. Coordinates may be negative.
#pragma once

#include <openvdb/math/Coord.h>

namespace volcomp {

constexpr int kLeafDim = 8;     ///< voxels along the edge of a leaf
constexpr int kLeafSize = 512;  ///< voxels of a leaf
constexpr int kNodeDim = 128;   ///< voxels along the edge of a node
constexpr int kNodeSize = 4096; ///< leaves of a node

/// The number of voxel (x, y, z) in its leaf.
constexpr int numberInLeaf(int x, int y, int z) { return (x & 7) << 6 | (y & 7) << 3 | (z & 7); }

/// The voxel of number n, from its leaf's first.
inline openvdb::math::Coord voxelInLeaf(int n) { return {n >> 6, n >> 3 & 7, n & 7}; }

/// The number of the leaf that holds voxel (x, y, z) in its node.
constexpr int numberInNode(int x, int y, int z)
{
    return (x >> 3 & 15) << 8 | (y >> 3 & 15) << 4 | (z >> 3 & 15);
}

/// The same for the leaf that holds c.
inline int numberInNode(const openvdb::math::Coord& c) { return numberInNode(c[0], c[1], c[2]); }

/// The first voxel of the leaf of number n, from its node's first voxel.
inline openvdb::math::Coord leafInNode(int n)
{
    return {(n >> 8) * kLeafDim, (n >> 4 & 15) * kLeafDim, (n & 15) * kLeafDim};
}

} // namespace volcomp
