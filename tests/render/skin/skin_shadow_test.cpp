// SPDX-License-Identifier: Apache-2.0
// The shadow of skins on the volume: maps against rays and against geometry.
#include "volcomp/render/skin/skin_shadow.h"

#include <gtest/gtest.h>

#include "tests/support/skins.h"
#include "tests/support/volumes.h"
#include "volcomp/base/random.h"

namespace volcomp {
namespace {

/// Voxels of 1/10 m from -6 to 6 m.
Volume space()
{
    Volume v = emptyVolume(0.1);
    for (const int x : {-60, 59})
        for (const int y : {-60, 59})
            for (const int z : {-60, 59}) v.parts[0].density->tree().setValue({x, y, z}, 1.0f);
    return v;
}

Light sun(const Vec3d& way)
{
    Light l;
    l.direction = way.unit();
    return l;
}

Light lampAt(const Vec3d& position)
{
    Light l;
    l.kind = LightKind::point;
    l.position = position;
    return l;
}

Vec3d anyDirection(Random& random)
{
    const double y = random.uniform(-1, 1), turn = random.uniform(0, 2 * kPi),
                 r = std::sqrt(1 - y * y);
    return {r * std::cos(turn), y, r * std::sin(turn)};
}

TEST(SkinShadow, MapsAgreeWithRaysAwayFromBorders)
{
    const Volume volume = space();
    const VoxelTree tree(volume);
    std::vector<SkinMesh> meshes;
    meshes.push_back(skinMesh(ballMesh(Vec3d(0.5, 0.3, -0.2), 1.5, 60)));
    meshes.push_back(skinMesh(squareMesh(Vec3d(-2, 2, 1), Vec3d(1, 2, 3).unit(), 2)));
    const SkinTracer skins(std::move(meshes));
    for (const Light& light :
         {sun({0, -1, 0}), sun({1, -1, 0}), sun({-0.3, 0.2, 1}), sun({5, 1, -1}), lampAt({0, 4, 1}),
          lampAt({-2, 1.5, 0.5}), lampAt({20, 3, -7})}) {
        const SkinShadow rays(skins, tree, {light}, Shadows::exact),
            maps(skins, tree, {light}, Shadows::sweep);
        Random random(7);
        int differ = 0, borders = 0, dark = 0;
        constexpr int kPoints = 20000;
        for (int i = 0; i < kPoints; ++i) {
            const Vec3d p(random.uniform(-59, 59), random.uniform(-59, 59),
                          random.uniform(-59, 59));
            const double exact = rays.lightAt(0, p), map = maps.lightAt(0, p);
            dark += exact == 0;
            // A border is where a ray a voxel and a half beside it says something else.
            bool border = false;
            for (int a = 0; a < 6; ++a) {
                Vec3d beside = p;
                beside[a / 2] += a % 2 ? 1.5 : -1.5;
                border |= rays.lightAt(0, beside) != exact;
            }
            borders += border;
            differ += !border && map != exact;
        }
        EXPECT_LE(differ, kPoints / 5000) << light.direction << light.position;
        EXPECT_GT(dark, kPoints / 500);
        EXPECT_LT(borders, kPoints / 10);
        EXPECT_EQ(rays.memoryBytes(), 0u);
        EXPECT_GT(maps.memoryBytes(), 3000u);
        EXPECT_LT(maps.memoryBytes(), 20000000u);
    }
}

// Points just above a lit skin are lit, whatever the angle, and those below are dark from a voxel
// or two on.
TEST(SkinShadow, PlanesThatTheLightGrazesDoNotShadeThemselves)
{
    const Volume volume = space();
    const VoxelTree tree(volume);
    Random random(9);
    for (int turn = 0; turn < 30; ++turn) {
        const Vec3d normal = anyDirection(random);
        const auto plane = tracerOf(skinMesh(squareMesh(Vec3d(0.1, 0.2, 0.3), normal, 40)));
        const double facing = turn % 3 == 0 ? 0.02 : random.uniform(0.05, 1);
        const Vec3d along = normal.cross(anyDirection(random)).unit();
        const Light light = sun(along * std::sqrt(1 - facing * facing) - normal * facing);
        const SkinShadow maps(*plane, tree, {light}, Shadows::sweep);
        for (int i = 0; i < 300; ++i) {
            const Vec3d flat(random.uniform(-3, 3), random.uniform(-3, 3), random.uniform(-3, 3)),
                on = Vec3d(0.1, 0.2, 0.3) + flat - normal * flat.dot(normal);
            EXPECT_EQ(maps.lightAt(0, tree.toCorner(on + normal * 1e-4)), 1) << facing;
            EXPECT_LT(maps.lightAt(0, tree.toCorner(on - normal * 0.13)), 0.1) << facing;
            EXPECT_EQ(maps.lightAt(0, tree.toCorner(on - normal * 0.2)), 0) << facing;
        }
    }
}

TEST(SkinShadow, ABallsLitSideIsLit)
{
    const Volume volume = space();
    const VoxelTree tree(volume);
    const auto ball = tracerOf(skinMesh(ballMesh(Vec3d(0.0), 4, 100))); // 40 voxels
    Random random(11);
    for (const Light& light : {sun({1, -2, 0.5}), lampAt({0, 5.9, 0})}) {
        const SkinShadow maps(*ball, tree, {light}, Shadows::sweep);
        int dark = 0, lit = 0;
        for (int i = 0; i < 20000; ++i) {
            const Vec3d n = anyDirection(random), p = n * 4.0005;
            const Vec3d L = light.kind == LightKind::directional ? -light.direction
                                                                 : (light.position - p).unit();
            if (n.dot(L) < 0.1) continue;
            ++lit;
            dark += maps.lightAt(0, tree.toCorner(p)) < 1;
        }
        EXPECT_GT(lit, 1000);
        EXPECT_LE(dark, lit / 500) << light.direction;
    }
}

} // namespace
} // namespace volcomp
