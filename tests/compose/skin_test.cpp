// SPDX-License-Identifier: Apache-2.0
#include "volcomp/compose/skin.h"

#include <cmath>

#include <gtest/gtest.h>

#include "volcomp/compose/compose.h"

namespace volcomp {
namespace {

struct Start {
    Start() { openvdb::initialize(); }
} start;

Surface slab(double edge, const Vec3d& normal)
{
    const Vec3d n = normal.unit(),
                a = n.cross(std::abs(n[0]) < 0.5 ? Vec3d(1, 0, 0) : Vec3d(0, 1, 0)).unit() * edge,
                b = n.cross(a);
    Mesh m;
    m.points = {-a - b, a - b, a + b, b - a};
    m.triangles = {{0, 1, 2}, {0, 2, 3}};
    m.normals.assign(4, Vec3f(n));
    return Surface(std::move(m), MapProjection{});
}

/// A scene of one surface with a skin.
PlacedScene skinAlone(Surface surface, const SkinSpec& spec)
{
    PlacedScene scene;
    scene.surfaces.push_back({"surface", std::move(surface), spec, SecondDensity(spec.maps, true)});
    return scene;
}

TEST(Skin, TheOpticalDepthAlongTheNormalIsAsAskedAtAnyVoxelAndTurn)
{
    SkinSpec spec;
    spec.material = "leather";
    spec.as = SkinAs::voxels;
    spec.transmittance = 1e-3;
    spec.colour = Vec3d(0.2, 0.1, 0.05);
    for (const Vec3d normal : {Vec3d(0, 1, 0), Vec3d(1, 2, 3), Vec3d(1, 1, 0)})
        for (const double h : {0.02, 0.05}) {
            ComposeParams params;
            params.voxel = h;
            const PlacedScene scene = skinAlone(slab(1, normal), spec);
            const Volume v = unpack(compose({}, scene, params));
            ASSERT_EQ(v.parts.size(), 1u);
            EXPECT_EQ(v.parts[0].kind, MaterialKind::surface);
            double mass = 0;
            for (auto it = v.parts[0].density->cbeginValueOn(); it; ++it) {
                mass += *it;
                const Vec3d n(v.parts[0].direction->tree().getValue(it.getCoord()));
                EXPECT_GT(std::abs(n.dot(normal.unit())), 0.99);
            }
            // Directed extinction counts a sheet that is seen face on twice.
            const double wanted = -0.5 * std::log(1e-3);
            EXPECT_NEAR(mass * h * h * h / scene.surfaces[0].surface.area(), wanted, 1e-3 * wanted);
            EXPECT_EQ(v.parts[0].colour, nullptr);
            EXPECT_NEAR(v.parts[0].uniform_colour[1], 0.1, 1e-6);
            // A shell as thick as a voxel is coarse for a single ray (2/3 to 4/3 along (1,1,0)),
            // but no ray finds a hole.
            for (int k = 0; k < 50; ++k) {
                const Vec3d from =
                    normal.unit().cross(Vec3d(std::sin(k), std::cos(k), std::sin(3 * k))) * 0.3;
                double depth = 0;
                for (double t = -4 * h; t < 4 * h; t += 0.01 * h) {
                    const Vec3d p = (from + normal.unit() * t) / h;
                    depth +=
                        0.01 * h * v.parts[0].density->tree().getValue(openvdb::Coord::round(p));
                }
                EXPECT_GT(depth, 0.4 * wanted) << normal << h << from;
            }
        }
}

TEST(Skin, LiesUnderTheSurfaceWhereAsked)
{
    SkinSpec spec;
    spec.material = "leather";
    spec.as = SkinAs::voxels;
    spec.depth = 3;
    ComposeParams params;
    params.voxel = 0.05;
    const Volume v = unpack(compose({}, skinAlone(slab(1, {0, 1, 0}), spec), params));
    double mean = 0, sum = 0;
    for (auto it = v.parts[0].density->cbeginValueOn(); it; ++it) {
        mean += *it * it.getCoord()[1];
        sum += *it;
    }
    EXPECT_NEAR(mean / sum, -3, 0.01);
}

TEST(Skin, OfPartsThatIntersectTheDensitiesAdd)
{
    Mesh crossed = slab(0.5, {1, 0, 0}).mesh();
    const Mesh other = slab(0.5, {0, 0.1, 1}).mesh();
    for (const Vec3d& p : other.points) crossed.points.push_back(p);
    crossed.normals.insert(crossed.normals.end(), other.normals.begin(), other.normals.end());
    for (std::array<std::int32_t, 3> t : other.triangles)
        crossed.triangles.push_back({t[0] + 4, t[1] + 4, t[2] + 4});
    SkinSpec spec;
    spec.material = "leather";
    spec.as = SkinAs::voxels;
    spec.transmittance = 1e-3;
    ComposeParams params;
    params.voxel = 0.02;
    const auto skinOf = [&](Surface s) {
        return unpack(compose({}, skinAlone(std::move(s), spec), params)).parts.at(0);
    };
    const VolumePart both = skinOf(Surface(crossed, MapProjection{})),
                     a = skinOf(slab(0.5, {1, 0, 0})), b = skinOf(slab(0.5, {0, 0.1, 1}));
    double line = 0;
    for (auto it = both.density->cbeginValueOn(); it; ++it) {
        const float in_a = a.density->tree().getValue(it.getCoord()),
                    in_b = b.density->tree().getValue(it.getCoord());
        EXPECT_NEAR(*it, in_a + in_b, 1e-4f * (in_a + in_b));
        if (in_a > 0 && in_b > 0) line += 1;
    }
    EXPECT_GT(line, 50); // where they cross
    EXPECT_GE(both.density->activeVoxelCount(), a.density->activeVoxelCount());
}

} // namespace
} // namespace volcomp
