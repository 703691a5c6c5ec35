// SPDX-License-Identifier: Apache-2.0
#include "volcomp/compose/coarsen.h"

#include <gtest/gtest.h>

#include "volcomp/volume/coarser_voxel.h"
#include "volcomp/volume/volume.h"

namespace volcomp {
namespace {

// Leaves far from each other, each of `edge` x `edge` voxels in a plane of y, all full of one leaf.
SourcePart leaves(int edge, float density)
{
    VolumePart part;
    part.kind = MaterialKind::surface;
    part.density = openvdb::FloatGrid::create(0.0f);
    part.own_share = openvdb::FloatGrid::create(0.0f);
    part.direction = openvdb::Vec3SGrid::create(openvdb::Vec3s(0.0f));
    for (int leaf = 0; leaf < 20; ++leaf)
        for (int x = 0; x < edge; ++x)
            for (int z = 0; z < edge; ++z) {
                const openvdb::Coord voxel(64 * leaf + x, 64 * (leaf % 3), z);
                part.density->tree().setValue(voxel, density);
                part.own_share->tree().setValue(voxel, 1.0f);
                part.direction->tree().setValue(voxel, openvdb::Vec3s(0, 1, 0));
            }
    return packPart(part, "leaves");
}

} // namespace

// Rays that render a part take its own shares times its ownWeight(). A scatter ratio is over what a
// voxel scatters with these, whatever those of the finer part were.
TEST(Coarsen, ScatterRatiosAreOverTheCoarserPartsOwnShares)
{
    openvdb::initialize();
    constexpr float kDensity = 0.6f;
    const SourcePart fine = leaves(2, kDensity);
    ASSERT_NEAR(fine.ownWeight(), 1, 1e-6); // sheets of 2 x 2 voxels
    const SourcePart coarse = coarsen(fine, Kept::blocked_light);
    ASSERT_NEAR(coarse.ownWeight(), 0, 1e-6); // specks
    EightVoxels eight;
    for (const int k : {0, 1, 4, 5}) {
        eight.densities[std::size_t(k)] = kDensity;
        eight.own_shares[std::size_t(k)] = 1;
        eight.same_beside[std::size_t(k)] = {1, 0, 1};
    }
    ASSERT_EQ(coarse.scatter_ratios.size(), 20u); // a leaf lies in one voxel
    for (std::size_t k = 0; k < coarse.scatter_ratios.size(); ++k) {
        const auto density = double(coarse.voxels[k].density());
        const ScatterRatio expected = scatterRatioOf(eight, density, 0, fine.voxel);
        for (std::size_t i = 0; i < 3; ++i)
            EXPECT_NEAR(coarse.scatter_ratios[k][i], expected[i], 1e-5f);
    }
}

} // namespace volcomp
