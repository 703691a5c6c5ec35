// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/skin/skin_tracer.h"

#include <gtest/gtest.h>

#include "tests/support/skins.h"
#include "tests/support/temporary_folder.h"
#include "volcomp/base/random.h"
#include "volcomp/view/image.h"

namespace volcomp {
namespace {

Vec3d anyDirection(Random& random)
{
    const double y = random.uniform(-1, 1), turn = random.uniform(0, 2 * kPi),
                 r = std::sqrt(1 - y * y);
    return {r * std::cos(turn), y, r * std::sin(turn)};
}

/// Where a ray meets a triangle of the mesh first, by trying all of them; infinite if none.
double firstOf(const Mesh& mesh, const Vec3d& o, const Vec3d& d)
{
    double first = kInfinity;
    for (const auto& t : mesh.triangles) {
        const Vec3d a = mesh.points[t[0]], e1 = mesh.points[t[1]] - a, e2 = mesh.points[t[2]] - a,
                    n = e1.cross(e2);
        const double at = (a - o).dot(n) / d.dot(n);
        const Vec3d p = o + d * at - a;
        const double b1 = p.cross(e2).dot(n) / n.lengthSqr(),
                     b2 = e1.cross(p).dot(n) / n.lengthSqr();
        if (at > 0 && b1 >= 0 && b2 >= 0 && b1 + b2 <= 1) first = std::min(first, at);
    }
    return first;
}

TEST(SkinTracer, FindsTheFirstOfAllTrianglesToDoublePrecisionAlsoFarFromTheOrigin)
{
    for (const Vec3d centre : {Vec3d(0.0), Vec3d(3e5, -2e5, 1e5)}) {
        const Mesh ball = ballMesh(centre, 1, 12);
        const auto tracer = tracerOf(skinMesh(ball));
        Random random(3);
        int hits = 0;
        for (int i = 0; i < 2000; ++i) {
            const Vec3d from = anyDirection(random) * 1000,
                        d = (anyDirection(random) * 0.9 - from).unit(), o = centre + from;
            const double expected = firstOf(ball, o, d);
            const auto hit = tracer->hit(o, d);
            ASSERT_EQ(hit.has_value(), expected < kInfinity) << i;
            if (!hit) continue;
            ++hits;
            EXPECT_NEAR(hit->distance, expected, 2e-8);
            EXPECT_NEAR((hit->position - (o + d * expected)).length(), 0, 1e-6);
            EXPECT_LT(hit->face.dot(d), 0);
            EXPECT_LT(hit->normal.dot(d), 0);
            EXPECT_GT(hit->normal.dot((hit->position - centre).unit()), 0.9);
            EXPECT_FALSE(tracer->hit(o, d, 0, expected - 1e-3));
            EXPECT_TRUE(tracer->isOccluded(o, d, expected + 1e-3));
            EXPECT_FALSE(tracer->isOccluded(o, d, expected - 1e-3));
            // Behind the first there is the far side of the ball.
            const auto second = tracer->meeting(o, d, expected + 1e-3);
            if (second) {
                EXPECT_GT(second->distance, expected);
            }
        }
        EXPECT_GT(hits, 1000);
    }
}

// The lit side of a closed body is lit, at any angle and also by rays that leave it along the
// triangles, and its other side is not.
TEST(SkinTracer, RaysThatLeaveAConvexBodyDoNotMeetIt)
{
    for (const Vec3d centre : {Vec3d(0.0), Vec3d(3e5, -2e5, 1e5)}) {
        const auto tracer = tracerOf(skinMesh(ballMesh(centre, 1, 40)));
        Random random(5);
        for (int i = 0; i < 5000; ++i) {
            const Vec3d from = anyDirection(random) * 3;
            const auto hit = tracer->hit(centre + from, -from.unit());
            ASSERT_TRUE(hit);
            Vec3d L = anyDirection(random);
            if (i % 2) // barely above the triangle
                L = (L - hit->face * (L.dot(hit->face) - 1e-4)).unit();
            // Below the triangle, but above those around it, the round surface may be lit.
            const double facing = L.dot(hit->face);
            if (facing < 1e-5 && facing > -0.1) continue;
            EXPECT_EQ(tracer->isOccluded(hit->start, L, kInfinity), facing < 0)
                << i << ' ' << facing;
        }
    }
}

// A ball of few triangles is lit as far as its normals say.
TEST(SkinTracer, FlatTrianglesDoNotDarkenWhatTheLightGrazes)
{
    const auto tracer = tracerOf(skinMesh(ballMesh(Vec3d(0.0), 1, 16)));
    Random random(6);
    const Vec3d L = anyDirection(random);
    int lit = 0, dark = 0, by_triangle = 0;
    for (int i = 0; i < 20000; ++i) {
        const Vec3d from = anyDirection(random) * 3;
        const auto hit = tracer->hit(from, -from.unit());
        ASSERT_TRUE(hit);
        if (hit->normal.dot(L) < 0.02) continue;
        ++lit;
        dark += tracer->isOccluded(hit->start, L, kInfinity);
        by_triangle += tracer->isOccluded(hit->position + hit->face * 1e-5, L, kInfinity);
    }
    EXPECT_GT(by_triangle, lit / 100);
    EXPECT_LT(dark, by_triangle / 20);
}

TEST(SkinTracer, AHugeMeshHasItsPlaceBesideASmallOne)
{
    std::vector<SkinMesh> meshes;
    meshes.push_back(skinMesh(squareMesh(Vec3d(0, -1, 0), Vec3d(0, 1, 0), 20000)));
    meshes.push_back(skinMesh(ballMesh(Vec3d(0.0), 0.01, 20), wallMaterial(), Vec3d(0.5)));
    const SkinTracer tracer(std::move(meshes));
    const auto ball = tracer.hit(Vec3d(0, 5, 0), Vec3d(1e-4, -1, 0).unit());
    ASSERT_TRUE(ball);
    EXPECT_EQ(ball->skin, 1u);
    EXPECT_NEAR(ball->distance, 4.99, 1e-4);
    EXPECT_EQ(ball->colour, Vec3d(0.5));
    const auto ground = tracer.hit(Vec3d(0, 5, 0), Vec3d(0.01, -1, 0).unit());
    ASSERT_TRUE(ground);
    EXPECT_EQ(ground->skin, 0u);
    EXPECT_NEAR(ground->position[1], -1, 1e-9);
    EXPECT_TRUE(tracer.isOccluded(Vec3d(0, -0.5, 0), Vec3d(0, 1, 0), kInfinity));
    EXPECT_FALSE(tracer.isOccluded(ground->start, Vec3d(0, 1, 0), kInfinity));
}

TEST(SkinTracer, AlphaBelowOneHalfIsNoSurface)
{
    const TemporaryFolder folder;
    Image leaf; // its left half is opaque
    leaf.width = 4, leaf.height = 1;
    leaf.channels = {"R", "G", "B", "A"};
    for (int x = 0; x < 4; ++x)
        for (const float v : {x < 2 ? 0.25f : 0.0f, 0.0f, 0.0f, x < 2 ? 1.0f : 0.0f})
            leaf.pixels.push_back(v);
    writeImage(folder / "leaf.exr", leaf);
    MapFactor map;
    map.image = folder / "leaf.exr";
    map.wrap = Wrap::clamp;
    const auto tracer = tracerOf(
        skinMesh(squareMesh(Vec3d(0.0), Vec3d(0, 0, 1), 2), wallMaterial(), Vec3d(1, 1, 1), {map}));
    int hits = 0;
    for (int x = 0; x < 200; ++x) {
        const Vec3d o(-1 + (x + 0.5) / 100, 0.3, 1);
        const auto hit = tracer->hit(o, Vec3d(0, 0, -1));
        // Between the middles of the second and the third pixel alpha falls from 1 to 0.
        EXPECT_EQ(hit.has_value(), o[0] < 0) << o[0];
        EXPECT_EQ(tracer->isOccluded(o, Vec3d(0, 0, -1), 2), o[0] < 0) << o[0];
        if (hit && o[0] < -0.3) {
            EXPECT_NEAR(hit->colour[0], 0.25, 1e-4);
        }
        hits += hit.has_value();
    }
    EXPECT_EQ(hits, 100);
}

TEST(SkinTracer, TrianglesWithoutAreaAndNoMeshesAreNothing)
{
    Mesh square = squareMesh(Vec3d(0.0), Vec3d(0, 0, 1), 2);
    square.uv.clear();
    square.triangles.insert(square.triangles.begin(), {{0, 1, 1}});
    square.triangles.push_back({0, 2, 2});
    const auto tracer = tracerOf(skinMesh(std::move(square)));
    EXPECT_EQ(tracer->triangles(), 4u);
    const auto hit = tracer->hit(Vec3d(0, 0, 2), Vec3d(0, 0, -1));
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->normal[2], 1, 1e-12);
    const SkinTracer none({});
    EXPECT_TRUE(none.empty());
    EXPECT_FALSE(none.hit(Vec3d(0.0), Vec3d(1, 0, 0)));
    EXPECT_FALSE(none.isOccluded(Vec3d(0.0), Vec3d(1, 0, 0), kInfinity));
}

} // namespace
} // namespace volcomp
