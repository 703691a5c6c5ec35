// SPDX-License-Identifier: Apache-2.0
#include "volcomp/surface/surface.h"

#include <cmath>

#include <gtest/gtest.h>

#include "volcomp/base/error.h"
#include "volcomp/base/random.h"
#include "volcomp/surface/surface_tree.h"

namespace volcomp {
namespace {

/// A sphere of unit radius whose texture coordinates are longitude and latitude.
Mesh sphere(int rows)
{
    Mesh m;
    const auto point = [](double u, double v) {
        const double lon = (u - 0.5) * 2 * kPi, lat = (v - 0.5) * kPi;
        return Vec3d(std::sin(lon) * std::cos(lat), std::sin(lat), std::cos(lon) * std::cos(lat));
    };
    for (int j = 0; j < rows; ++j)
        for (int i = 0; i < 2 * rows; ++i) {
            const double u0 = i / (2.0 * rows), u1 = (i + 1) / (2.0 * rows), v0 = double(j) / rows,
                         v1 = double(j + 1) / rows;
            const auto n = static_cast<std::int32_t>(m.points.size());
            const Vec2d uv[4] = {{u0, v0}, {u1, v0}, {u1, v1}, {u0, v1}};
            for (const Vec2d& x : uv) m.points.push_back(point(x[0], x[1]));
            m.triangles.push_back({n, n + 1, n + 2});
            m.triangles.push_back({n, n + 2, n + 3});
            m.uv.push_back({Vec2f(uv[0]), Vec2f(uv[1]), Vec2f(uv[2])});
            m.uv.push_back({Vec2f(uv[0]), Vec2f(uv[2]), Vec2f(uv[3])});
        }
    for (const Vec3d& p : m.points) m.normals.emplace_back(p);
    return m;
}

MapProjection projection(ProjectionKind kind)
{
    MapProjection p;
    p.kind = kind;
    return p;
}

TEST(Projection, lineAndProjectAreInverse)
{
    for (const ProjectionKind kind :
         {ProjectionKind::sphere, ProjectionKind::cylinder, ProjectionKind::plane}) {
        MapProjection p = projection(kind);
        p.centre = Vec3d(0.3, -2, 5);
        p.axis = Vec3d(1, 2, -0.5).unit();
        p.up = Vec3d(0.2, 0, 1).unit();
        p.width = 3;
        p.height = 0.7;
        for (int k = 0; k < 200; ++k) {
            Random r(hashKey(1, k));
            const Vec2d uv(r.uniform(), r.uniform(0.01, 0.99));
            const MapProjection::Line line = p.line(uv);
            EXPECT_NEAR(line.direction.length(), 1, 1e-12);
            const Vec2d back = p.project(line.origin + line.direction * r.uniform(0.1, 4));
            EXPECT_NEAR(back[0], uv[0], 1e-9);
            EXPECT_NEAR(back[1], uv[1], 1e-9);
        }
    }
}

TEST(Projection, theMapStandsUprightForAnEyeOutside)
{
    const MapProjection ball = projection(ProjectionKind::sphere); // axis +Y, the middle faces +Z
    EXPECT_NEAR(ball.project({0, 0, 2})[0], 0.5, 1e-12);
    EXPECT_GT(ball.project({0.1, 0, 2})[0],
              0.5); // right of the middle for an eye at +Z that looks to -Z
    EXPECT_GT(ball.project({0, 0.1, 2})[1], 0.5);
    const MapProjection flat = projection(ProjectionKind::plane); // seen from +Y, up is +Z
    EXPECT_LT(flat.project({0.1, 0, 0})[0],
              0.5); // an eye above that looks down with +Z up has -X at its right
    EXPECT_GT(flat.project({0, 0, 0.1})[1], 0.5);
}

TEST(Projection, poleAndSeamAreFinite)
{
    const MapProjection p = projection(ProjectionKind::sphere);
    EXPECT_NEAR(p.project({0, 1, 0})[1], 1, 1e-12);
    EXPECT_NEAR(p.project({0, -1, 0})[1], 0, 1e-12);
    for (const double x : {0.0, -0.0, 1e-300, -1e-300}) {
        const double u = p.project({x, 0, -1})[0];
        EXPECT_TRUE(u >= 0 && u < 1) << u;
    }
    EXPECT_TRUE(std::isfinite(p.project({0, 0, 0})[0] + p.project({0, 0, 0})[1]));
}

TEST(Surface, fractionsOfTheAreaCoverItEvenly)
{
    const Surface s(sphere(24), projection(ProjectionKind::sphere));
    EXPECT_NEAR(s.area(), 4 * kPi, 0.05);
    // Heights of points spread evenly over a sphere are even in [-1, 1] (Archimedes).
    const int n = 20000;
    int below = 0, bins[20] = {};
    for (int i = 0; i < n; ++i) {
        const SurfacePoint p = s.atFraction((i + 0.5) / n);
        EXPECT_NEAR(p.position.length(), 1, 0.01);
        EXPECT_NEAR(p.normal.dot(p.position.unit()), 1, 0.01);
        ++bins[std::min(19, int((p.position[1] + 1) * 10))];
        below += p.position[0] < 0;
    }
    EXPECT_NEAR(below, n / 2, 30);
    for (const int b : bins) EXPECT_NEAR(b, n / 20, 60);
}

TEST(Surface, stratifiedPointsKeepTheirDistance)
{
    // The mean distance to the nearest other point, times twice the root of the density, is 1 for
    // random points and 2.15 at most.
    Mesh m;
    m.points = {{0, 0, 0}, {1, 0, 0}, {1, 0, 1}, {0, 0, 1}};
    m.triangles = {{0, 2, 1}, {0, 3, 2}};
    m.normals.assign(4, Vec3f(0, 1, 0));
    const Surface s(std::move(m), projection(ProjectionKind::plane));
    const int n = 2000;
    const auto clark = [&](bool stratified) {
        std::vector<Vec3d> p;
        for (int i = 0; i < n; ++i) {
            Random r(hashKey(9, i));
            p.push_back(s.atFraction(stratified ? (i + r.uniform()) / n : r.uniform()).position);
        }
        double sum = 0;
        for (int i = 0; i < n; ++i) {
            double best = 9;
            for (int j = 0; j < n; ++j)
                if (i != j) best = std::min(best, (p[i] - p[j]).lengthSqr());
            sum += std::sqrt(best);
        }
        return 2 * sum / n * std::sqrt(double(n));
    };
    EXPECT_NEAR(clark(false), 1, 0.06);
    EXPECT_GT(clark(true), 1.15);
    // Each 1/64 of the square is a cell of the curve, and gets its share of points.
    int cells[8][8] = {};
    for (int i = 0; i < 64 * 64; ++i) {
        Random r(hashKey(10, i));
        const Vec3d p = s.atFraction((i + r.uniform()) / (64 * 64)).position;
        ++cells[std::min(7, int(p[0] * 8))][std::min(7, int(p[2] * 8))];
    }
    double variance = 0;
    for (const auto& row : cells)
        for (const int c : row) variance += (c - 64.0) * (c - 64.0) / 64;
    EXPECT_LT(variance, 64.0 / 2); // it is 64 for random points
}

TEST(Surface, sheetsComeFromOutsideInward)
{
    Mesh m = sphere(16), inner = sphere(16);
    const auto base = static_cast<std::int32_t>(m.points.size());
    for (const Vec3d& p : inner.points) m.points.push_back(p * 0.5);
    for (const auto& t : inner.triangles)
        m.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
    m.normals.insert(m.normals.end(), inner.normals.begin(), inner.normals.end());
    m.uv.insert(m.uv.end(), inner.uv.begin(), inner.uv.end());
    const Surface s(std::move(m), projection(ProjectionKind::sphere));
    for (int k = 0; k < 300; ++k) {
        Random r(hashKey(3, k));
        // Half of the lines go exactly through corners and edges of the mesh.
        const Vec2d uv = k % 2
            ? Vec2d(r.uniform(), r.uniform())
            : Vec2d(std::floor(r.uniform() * 32) / 32, std::floor(r.uniform() * 16) / 16);
        const auto sheets = s.sheets(uv);
        ASSERT_EQ(sheets.size(), 2u) << uv[0] << " " << uv[1];
        EXPECT_GT(sheets[0].position.length(), 0.9);
        EXPECT_LT(sheets[1].position.length(), 0.6);
    }
}

TEST(Surface, textureCoordinatesLeadBackToThePlace)
{
    const Surface s(sphere(16), projection(ProjectionKind::uv));
    for (int k = 0; k < 200; ++k) {
        Random r(hashKey(4, k));
        const Vec2d uv(r.uniform(),
                       r.uniform(0.07, 0.93)); // at the poles half of the triangles have no area
        const auto sheets = s.sheets(uv);
        ASSERT_EQ(sheets.size(), 1u);
        EXPECT_NEAR(sheets[0].uv[0], uv[0], 1e-6);
        EXPECT_NEAR(sheets[0].uv[1], uv[1], 1e-6);
        const SurfacePoint back = s.nearest(sheets[0].position + sheets[0].normal * 0.001);
        EXPECT_LT((back.position - sheets[0].position).length(), 1e-3);
        EXPECT_NEAR(back.uv[1], uv[1], 2e-3);
    }
    EXPECT_TRUE(s.sheets({3, 3}).empty());
}

TEST(Surface, trianglesWithoutAreaAreNeverHit)
{
    Mesh m;
    m.points = {{0, 0, 0}, {1, 0, 0}, {0, 0, 1}, {2, 0, 0}};
    m.triangles = {{0, 1, 3}, {0, 2, 1}, {0, 0, 0}};
    m.normals.assign(4, Vec3f(0.0f));
    const Surface s(std::move(m), projection(ProjectionKind::plane));
    for (const double f : {0.0, 0.3, 1.0}) {
        const SurfacePoint p = s.atFraction(f);
        EXPECT_EQ(p.triangle, 1);
        EXPECT_NEAR(p.normal.length(), 1, 1e-12); // the triangle's own, as the points have none
    }
    Mesh none;
    none.points = {{0, 0, 0}, {1, 0, 0}};
    none.triangles = {{0, 1, 0}};
    none.normals.assign(2, Vec3f(0.0f));
    EXPECT_THROW(Surface(std::move(none), projection(ProjectionKind::plane)), Error);
}

TEST(SurfaceTree, nearestEqualsBruteForce)
{
    std::vector<Vec3d> points;
    std::vector<std::array<std::int32_t, 3>> triangles;
    Random r(5);
    for (int i = 0; i < 60; ++i) {
        const Vec3d c(r.symmetric(), r.symmetric(), r.symmetric());
        for (int k = 0; k < 3; ++k)
            points.push_back(c + Vec3d(r.symmetric(), r.symmetric(), r.symmetric()) * 0.2);
        triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    const SurfaceTree tree(points, triangles);
    for (int k = 0; k < 50; ++k) {
        const Vec3d p(r.symmetric() * 2, r.symmetric() * 2, r.symmetric() * 2);
        double best = 1e9; // the smallest over a fine grid of points on each triangle
        for (const auto& t : triangles)
            for (int i = 0; i <= 40; ++i)
                for (int j = 0; i + j <= 40; ++j)
                    best = std::min(best,
                                    (points[t[0]] + (points[t[1]] - points[t[0]]) * (i / 40.0)
                                     + (points[t[2]] - points[t[0]]) * (j / 40.0) - p)
                                        .length());
        const double found = (tree.nearest(p).position - p).length();
        EXPECT_LE(found, best + 1e-12);
        EXPECT_GT(found, best - 0.01);
    }
}

TEST(SurfaceWalk, findsWhatTheTreeFindsOnAConvexBody)
{
    // A ball with a fine and a coarse half, whose triangles share no corners: only their places say
    // that they are neighbours.
    Mesh m;
    const int rings = 24, across = 40;
    const auto at = [&](int i, int j) {
        const double theta = kPi * std::pow(double(i) / rings, 1.7),
                     phi = 2 * kPi * (j % across) / across;
        return i == 0    ? Vec3d(0, 1, 0)
            : i == rings ? Vec3d(0, -1, 0)
                         : Vec3d(std::sin(theta) * std::cos(phi), std::cos(theta),
                                 std::sin(theta) * std::sin(phi));
    };
    const auto add = [&](const Vec3d& a, const Vec3d& b, const Vec3d& c) {
        const auto n = static_cast<std::int32_t>(m.points.size());
        for (const Vec3d& p : {a, b, c}) m.points.push_back(p);
        m.triangles.push_back({n, n + 1, n + 2});
    };
    for (int i = 0; i < rings; ++i)
        for (int j = 0; j < across; ++j) {
            if (i > 0) add(at(i, j), at(i, j + 1), at(i + 1, j));
            add(at(i, j + 1), at(i + 1, j + 1), at(i + 1, j));
        }
    const SurfaceWalk walk(m);
    const SurfaceTree tree(m.points, m.triangles);
    std::int32_t triangle = 0;
    Vec3d direction = at(0, 0);
    for (int k = 0; k < 2000; ++k) {
        Random r(hashKey(5, k));
        direction = (direction + Vec3d(r.normal(), r.normal(), r.normal()) * 0.3).unit();
        const Vec3d p = direction * r.uniform(1.0, 1.3);
        const SurfaceWalk::Foot foot = walk.nearest(m, p, triangle);
        EXPECT_NEAR(std::sqrt(foot.distance2), (tree.nearest(p).position - p).length(), 1e-9) << k;
        const auto& c = m.triangles[foot.triangle];
        const Vec3d q = m.points[c[0]] * (1 - foot.b1 - foot.b2) + m.points[c[1]] * foot.b1
            + m.points[c[2]] * foot.b2;
        EXPECT_NEAR((q - p).lengthSqr(), foot.distance2, 1e-12);
        triangle = foot.triangle;
    }
}

TEST(SurfaceWalk, endsAtBordersAndOnTrianglesWithoutArea)
{
    Mesh m;
    m.points = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5, 0, 0}};
    m.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 4, 1}, {2, 2, 2}, {1, 2, 2}};
    const SurfaceWalk walk(m);
    for (std::int32_t start = 0; start < 3; ++start) {
        const SurfaceWalk::Foot far = walk.nearest(m, {-3, 5, 1}, start);
        EXPECT_NEAR(far.distance2, 9 + 16 + 1, 1e-12); // the corner (0, 1)
        EXPECT_NEAR(walk.nearest(m, {0.2, 0.7, 2}, start).distance2, 4, 1e-12);
        EXPECT_NEAR(walk.nearest(m, {0.5, 0.7, 2}, start).distance2, 4,
                    1e-12); // beyond the corner that the square lacks
    }
    for (std::int32_t start = 3; start < 5; ++start)
        EXPECT_TRUE(std::isfinite(walk.nearest(m, {0.2, 0.7, 2}, start).distance2));
}

TEST(SurfaceWalk, crossesEdgesOfOppositeWindingAndPassesSharedEdges)
{
    // A row of squares along x, wound at random; a fin stands on each edge between two of them.
    Mesh m;
    const int n = 40;
    for (int i = 0; i <= n; ++i)
        for (const Vec3d& p : {Vec3d(i, 0, 0), Vec3d(i, 1, 0), Vec3d(i, 0.5, -1)})
            m.points.push_back(p);
    Random r(3);
    for (int i = 0; i < n; ++i) {
        const int a = 3 * i, b = a + 1, c = a + 3, d = a + 4;
        for (std::array<std::int32_t, 3> t : {std::array{a, c, b}, {b, c, d}}) {
            if (r.uniform() < 0.5) std::swap(t[1], t[2]);
            m.triangles.push_back(t);
        }
    }
    for (int i = 0; i <= n; ++i) m.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    const SurfaceWalk walk(m);
    for (const std::int32_t start : {0, 2 * n - 1}) {
        const SurfaceWalk::Foot foot = walk.nearest(m, {n - 1.7, 0.4, 0.5}, start);
        EXPECT_NEAR(foot.distance2, 0.25, 1e-12);
        EXPECT_EQ(foot.triangle / 2, n - 2);
    }
}

TEST(SurfaceWalk, aFanOf100000TrianglesIsQuick)
{
    Mesh m;
    const int n = 100000;
    m.points.emplace_back(0, 0, 0);
    for (int i = 0; i < n; ++i)
        m.points.emplace_back(std::cos(2 * kPi * i / n), std::sin(2 * kPi * i / n), 0);
    for (int i = 0; i < n; ++i) m.triangles.push_back({0, 1 + i, 1 + (i + 1) % n});
    const SurfaceWalk walk(m);
    EXPECT_NEAR(walk.nearest(m, {std::cos(0.001), std::sin(0.001), 1}, 0).distance2, 1, 1e-9);
}

} // namespace
} // namespace volcomp
