// SPDX-License-Identifier: Apache-2.0
#include "volcomp/compose/compose.h"

#include <gtest/gtest.h>

#include "volcomp/place/scatter.h"
#include "tests/support/grounds.h"

namespace volcomp {
namespace {

struct Start {
    Start() { openvdb::initialize(); }
} start;

TEST(Estimate, isNearTheTruth)
{
    const Surface s = ground(2, 0);
    Layer l;
    l.name = "dots";
    l.density = 4000;
    l.tilt = {0, 1};
    PlacedScene scene;
    scene.boxes = scatter(s, l);
    ComposeParams params;
    params.voxel = 0.01;
    const std::vector<Box> boxes{dot(0.01)};
    const ComposeEstimate e = estimateCompose(boxes, scene, params);
    const PackedVolume v = compose(boxes, scene, params);
    EXPECT_NEAR(e.voxels / double(v.voxels()), 1, 0.1); // 256 of some 2,500 tiles
    const double least =
        double(v.voxels()) * sizeof(float) + double(v.parts[0].blocks.size()) * sizeof(PackedBlock);
    EXPECT_GT(e.bytes, 0.9 * least);
    EXPECT_LT(e.bytes, 3 * least);
    params.voxel = 1e-7; // must not take long, nor the memory
    const ComposeEstimate fine = estimateCompose(boxes, scene, params);
    EXPECT_GT(fine.bytes, 1e15);
    params.voxel = 2e-7;
    EXPECT_NEAR(fine.voxels / estimateCompose(boxes, scene, params).voxels, 8, 1e-9);
}

} // namespace
} // namespace volcomp
