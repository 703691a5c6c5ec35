// SPDX-License-Identifier: Apache-2.0
// What single strands and leaves block when they are voxels, against their projected area (MODEL
// section 2): many of them, at random places and turns, and many rays.
#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/boxes.h"
#include "volcomp/bake/rasterise.h"
#include "volcomp/render/march/march.h"

namespace volcomp {
namespace {

Vec3d randomDirection(Random& random)
{
    return Vec3d(random.normal(), random.normal(), random.normal()).unit();
}

/// The area that a volume blocks for rays along `d`, which meet it within `reach` of `centre`
/// (corner coordinates), under directed extinction.
double blockedArea(const VoxelTree& tree, const Vec3d& centre, const Vec3d& d, double reach,
                   Random& random)
{
    const Vec3d u = d.cross(std::abs(d[0]) < 0.7 ? Vec3d(1, 0, 0) : Vec3d(0, 1, 0)).unit(),
                v = d.cross(u);
    const int n = int(std::ceil(2 * reach / 0.15));
    const double cell = 2 * reach / n;
    double area = 0;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
            const Vec3d from = centre + (-reach + (i + random.uniform()) * cell) * u
                + (-reach + (j + random.uniform()) * cell) * v - 2 * reach * d;
            const MarchRay ray(tree, from, d, 4 * reach);
            area -= std::expm1(-lineIntegral<true>(tree, ray, d, 1e30)) * cell * cell;
        }
    return area;
}

/// What strands of a radius, or flat ones of a half width, block in voxels of edge 1, over what
/// they block.
double blockedOver(bool flat, double size, double length)
{
    Random random(hashKey(9, std::uint64_t(1000 * size + length)));
    double blocked = 0, exact = 0;
    for (int n = 0; n < 10; ++n) {
        const Vec3d t = randomDirection(random), side = t.cross(randomDirection(random)).unit(),
                    place(random.uniform(), random.uniform(), random.uniform());
        Segment s;
        s.a = Vec3f(place - 0.5 * length * t), s.b = Vec3f(place + 0.5 * length * t);
        s.size_a = s.size_b = float(size);
        if (flat) s.side = Vec3f(side);
        Volume volume;
        volume.parts.push_back(
            rasterise({s}, "m", flat ? MaterialKind::surface : MaterialKind::fibre, 1.0));
        const VoxelTree tree(volume);
        for (int k = 0; k < 10; ++k) {
            const Vec3d d = randomDirection(random);
            blocked += blockedArea(tree, tree.toCorner(place), d, 0.5 * length + size + 2, random);
            const double cosine = std::abs(d.dot(t)), sine = std::sqrt(1 - cosine * cosine);
            exact += flat ? 2 * size * length * std::abs(d.dot(t.cross(side)))
                          : 2 * size * length * sine + kPi * size * size * cosine;
        }
    }
    return blocked / exact;
}

TEST(BlockedArea, OfThinStrandsIsTheirProjectedArea)
{
    for (const double radius : {0.05, 0.1, 0.18, 0.25, 0.35, 0.45})
        EXPECT_NEAR(blockedOver(false, radius, 8), 1, 0.02) << radius;
}

TEST(BlockedArea, OfLeavesIsTheirProjectedArea)
{
    for (const double width : {0.2, 0.6, 1.0, 2.0, 4.0}) {
        EXPECT_NEAR(blockedOver(true, width / 2, 2 * width), 1, 0.05) << width;
        EXPECT_NEAR(blockedOver(true, width / 2, 12), 1, 0.06) << width;
    }
}

} // namespace
} // namespace volcomp
