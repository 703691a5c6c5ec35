// SPDX-License-Identifier: Apache-2.0
#include "volcomp/base/node_index.h"

#include <gtest/gtest.h>
#include <openvdb/openvdb.h>

namespace volcomp {
namespace {

using Leaf = openvdb::FloatTree::LeafNodeType;
using Node = openvdb::FloatTree::RootNodeType::ChildNodeType::ChildNodeType;

TEST(NodeIndex, NumbersAreThoseOfAnOpenvdbTree)
{
    static_assert(Leaf::DIM == kLeafDim && Leaf::SIZE == kLeafSize);
    static_assert(Node::DIM == kNodeDim && Node::NUM_VALUES == kNodeSize);
    for (const openvdb::Coord& c :
         {openvdb::Coord(0, 0, 0), openvdb::Coord(1, 2, 3), openvdb::Coord(-1, -2, -3),
          openvdb::Coord(127, 128, -129), openvdb::Coord(-1000, 999, 12345)}) {
        EXPECT_EQ(numberInLeaf(c[0], c[1], c[2]), int(Leaf::coordToOffset(c))) << c;
        EXPECT_EQ(numberInNode(c[0], c[1], c[2]), int(Node::coordToOffset(c))) << c;
    }
}

TEST(NodeIndex, PlacesAndNumbersAreInverse)
{
    for (int n = 0; n < kLeafSize; ++n) {
        const openvdb::Coord c = voxelInLeaf(n);
        EXPECT_EQ(numberInLeaf(c[0], c[1], c[2]), n);
    }
    for (int n = 0; n < kNodeSize; ++n) {
        const openvdb::Coord c = leafInNode(n);
        EXPECT_EQ(numberInNode(c[0], c[1], c[2]), n);
    }
}

} // namespace
} // namespace volcomp
