// SPDX-License-Identifier: Apache-2.0
#include "volcomp/surface/terrain.h"

#include <algorithm>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include "volcomp/base/error.h"

namespace volcomp {
namespace {

TEST(Terrain, heightsFollowTheMap)
{
    const std::filesystem::path file =
        std::filesystem::path(::testing::TempDir()) / "volcomp_terrain_test.pgm";
    std::ofstream(file) << "P2\n2 1\n255\n0 255\n";
    TerrainSpec spec;
    spec.width = 4;
    spec.depth = 2;
    spec.height_map = file;
    spec.low = 1;
    spec.high = 3;
    spec.cells = 64;
    Mesh m = makeTerrain(spec);
    prepareMesh(m, 1, Vec3d(0.0), Orientation::outward);
    EXPECT_EQ(m.triangles.size(), 64u * 32 * 2);
    for (const Vec3d& p : m.points)
        EXPECT_NEAR(p[1], 1 + 2 * std::clamp((p[0] + 1) / 2, 0.0, 1.0), 1e-5);
    for (const Vec3f& n : m.normals) EXPECT_GT(n[1], 0.6f);
    for (std::size_t t = 0; t < m.triangles.size(); ++t)
        for (int k = 0; k < 3; ++k) {
            const Vec3d& p = m.points[m.triangles[t][k]];
            EXPECT_NEAR(m.uv[t][k][0], 0.5 + p[0] / 4, 1e-6);
            EXPECT_NEAR(m.uv[t][k][1], 0.5 - p[2] / 2, 1e-6);
        }
    spec.width = 0;
    EXPECT_THROW(makeTerrain(spec), Error);
}

} // namespace
} // namespace volcomp
