// SPDX-License-Identifier: Apache-2.0
#include "volcomp/compose/voxel_tint.h"

#include <cmath>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include "tests/support/boxes.h"
#include "tests/support/grounds.h"
#include "volcomp/compose/compose.h"

namespace volcomp {
namespace {

constexpr double kEdge = 2; ///< of the ground, metres
constexpr double kVoxel = 1.0 / 64;

/// An image whose red is u, whose green is v and whose blue is 1/4, exactly except in the half
/// pixel at its border. Floats, which are linear; a PFM's rows run from the bottom.
MapFactor ramp()
{
    const std::filesystem::path file = std::filesystem::path(testing::TempDir())
        / (std::string("voxel_tint_")
           + testing::UnitTest::GetInstance()->current_test_info()->name() + ".pfm");
    std::ofstream stream(file, std::ios::binary);
    stream << "PF\n16 16\n-1.0\n";
    for (int y = 0; y < 16; ++y)
        for (int x = 0; x < 16; ++x) {
            const float pixel[3] = {(float(x) + 0.5f) / 16, (float(y) + 0.5f) / 16, 0.25f};
            stream.write(reinterpret_cast<const char*>(pixel), sizeof pixel);
        }
    MapFactor map;
    map.image = file;
    map.wrap = Wrap::clamp;
    return map;
}

/// A box that reaches far to the sides: each of its voxels has a (u,v) of its own.
Box plate(const Vec3f& colour)
{
    Box box{"plate", 0, {}};
    VolumePart part = fullPart(kVoxel);
    for (int x = -20; x <= 20; ++x)
        for (int z = -9; z <= 9; ++z)
            set(part, openvdb::Coord(x, 1 + (x & 3), z), 30, Vec3f(0, 1, 0), colour);
    box.volume.parts.push_back(part);
    return box;
}

PlacedScene tintedGround(const MapProjection& projection)
{
    TerrainSpec spec;
    spec.width = spec.depth = kEdge;
    Mesh mesh = makeTerrain(spec);
    prepareMesh(mesh, 1, Vec3d(0.0), Orientation::outward);
    PlacedScene scene;
    scene.surfaces.push_back(
        {"ground", Surface(std::move(mesh), projection), SkinSpec(), SecondDensity()});
    scene.layers.push_back({Layer(), 0, SecondDensity({ramp()}, true), true, 1});
    return scene;
}

/// Composes a plate that stands on the grid of the target, so that each of its voxels becomes one
/// of the volume, and compares the colour of each with the map at its own place.
void expectRamp(const PlacedScene& scene)
{
    const Vec3f own(0.5f, 1, 0.25f);
    ComposeParams params;
    params.voxel = kVoxel;
    const Volume v = unpack(compose({plate(own)}, scene, params));
    const VolumePart& part = v.parts.at(0);
    ASSERT_TRUE(part.colour);
    EXPECT_EQ(part.density->activeVoxelCount(), 41u * 19);
    for (auto it = part.density->cbeginValueOn(); it; ++it) {
        const Vec3d p = it.getCoord().asVec3d() * kVoxel;
        const double u = 0.5 + p[0] / kEdge, w = 0.5 - p[2] / kEdge;
        const Vec3f c = part.colour->tree().getValue(it.getCoord());
        ASSERT_NEAR(c[0], own[0] * u, 1e-3) << p;
        ASSERT_NEAR(c[1], own[1] * w, 1e-3) << p;
        ASSERT_NEAR(c[2], own[2] * 0.25, 1e-3) << p;
    }
}

Placement onTheGrid(double quarters)
{
    return turned({0, 1, 0}, quarters * kPi / 2, Vec3d(10, 0, -12) * kVoxel);
}

TEST(VoxelTint, byAPlaneEveryVoxelHasTheMapsColourAtItsPlace)
{
    MapProjection plane;
    plane.kind = ProjectionKind::plane;
    plane.up = Vec3d(0, 0, -1);
    plane.width = plane.height = kEdge;
    for (int quarters = 0; quarters < 4; ++quarters) {
        PlacedScene scene = tintedGround(plane);
        scene.boxes.placements = {onTheGrid(quarters)};
        expectRamp(scene);
    }
}

// On a flat mesh the nearest point is the one below. The walk finds it from any triangle, and from
// none.
TEST(VoxelTint, byTextureCoordinatesEveryVoxelHasTheColourOfTheSurfaceBelow)
{
    for (const std::int32_t start : {-1, 0, 1}) {
        PlacedScene scene = tintedGround(MapProjection{});
        scene.boxes.placements = {onTheGrid(1)};
        if (start >= 0) scene.boxes.triangles = {start};
        expectRamp(scene);
    }
}

// The voxels of a hair that stands on one wall of a narrow fold are nearer to the other wall, but
// they have the colour of their own.
TEST(VoxelTint, aHairKeepsToItsSideOfAFold)
{
    Mesh fold; // two walls at x = 0 and x = 0.1 that face each other, without a floor
    fold.points = {{0, 0, -1},   {0, 0, 1},   {0, 1, 1},   {0, 1, -1},
                   {0.1, 0, -1}, {0.1, 0, 1}, {0.1, 1, 1}, {0.1, 1, -1}};
    fold.triangles = {{0, 1, 2}, {0, 2, 3}, {4, 6, 5}, {4, 7, 6}};
    for (int t = 0; t < 4; ++t) {
        const float u = t < 2 ? 0.25f : 0.75f;
        fold.uv.push_back({Vec2f(u, 0.5f), Vec2f(u, 0.5f), Vec2f(u, 0.5f)});
    }
    prepareMesh(fold, 1, Vec3d(0.0), Orientation::file);
    const Surface surface(std::move(fold), MapProjection{});
    const SecondDensity map({ramp()}, true);
    TintWalk own({&surface, &map, 0}), nearest({&surface, &map, -1});
    const Vec3d tip(0.09, 0.5, 0);
    EXPECT_NEAR(own.at(tip)[0], 0.25, 1e-3);
    EXPECT_NEAR(nearest.at(tip)[0], 0.75, 1e-3);
}

} // namespace
} // namespace volcomp
