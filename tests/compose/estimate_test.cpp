// SPDX-License-Identifier: Apache-2.0
#include "volcomp/compose/compose.h"

#include <string>

#include <gtest/gtest.h>

#include "volcomp/place/scatter.h"
#include "tests/support/grounds.h"
#include "tests/support/message_of.h"

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
    params.voxel = 2e-7; // must not take long, nor the memory
    const ComposeEstimate fine = estimateCompose(boxes, scene, params);
    EXPECT_GT(fine.bytes, 1e14);
    params.voxel = 4e-7;
    EXPECT_NEAR(fine.voxels / estimateCompose(boxes, scene, params).voxels, 8, 1e-9);
}

TEST(Estimate, RefusesAtOnceAVoxelOfWhichThereWouldBeTooManyAndNamesOneThatWorks)
{
    Placement p;
    p.position = Vec3d(10, 0, 0);
    const PlacedScene scene = placedBoxes({p});
    const std::vector<Box> boxes{dot(0.01)};
    ComposeParams params;
    for (const double voxel : {6e-7 / 1.01, 1e-9, 1e-300, 5e-324}) {
        params.voxel = voxel;
        const std::string message = messageOf([&] { estimateCompose(boxes, scene, params); });
        // The scene reaches 10.005 m, and 10.005 / 2^24 = 5.963e-7.
        EXPECT_NE(message.find("voxel: expected at least 6.02e-07 m"), std::string::npos)
            << message;
        EXPECT_EQ(messageOf([&] { compose(boxes, scene, params); }), message);
    }
    params.voxel = 6.02e-7;
    EXPECT_GT(estimateCompose(boxes, scene, params).voxels, 1e12);
}

// A voxel of a box is divided into as many as 125 million parts here. Only those that reach into
// the estimate's tiles may cost.
TEST(Estimate, OfCoarseBoxesComposedFineIsTheirVolume)
{
    Box box{"block", 0, {}};
    box.volume.parts.push_back(emptyPart(0.5));
    box.volume.parts[0].density->fill(openvdb::CoordBBox({0, 0, 0}, {3, 3, 3}), 1.0f);
    Placement p;
    p.position = Vec3d(0.123, 0.234, 0.345);
    const PlacedScene scene = placedBoxes({p});
    ComposeParams params;
    for (const double voxel : {0.016, 0.008, 0.004, 0.001}) {
        params.voxel = voxel;
        EXPECT_NEAR(estimateCompose({box}, scene, params).voxels * voxel * voxel * voxel / 8, 1,
                    0.15)
            << voxel; // 8 cubic metres; tiles at the surface are drawn at random
    }
}

} // namespace
} // namespace volcomp
